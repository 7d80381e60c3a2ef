#include "tests/fuzz/support/packed_mutator.h"

#include <algorithm>

#include "core/base/hash.h"

namespace atlas::fuzz {
namespace {

constexpr std::size_t kHashBytes = 8;
constexpr std::size_t kMaxFlatBytes = 256u << 10;

}  // namespace

Bytes MutatePacked(ByteSpan input, std::size_t max_size, Random& random, const Packing& packing) {
  if (const auto flat = packing.unpack(input); flat && !OneIn(8, random)) {
    Bytes packed = packing.pack(Garbled(*flat, std::max(kMaxFlatBytes, flat->size())));
    if (packed.size() <= max_size) {
      return packed;
    }
  }
  Bytes changed = Garbled(input, max_size);
  if (packing.seal != nullptr && !OneIn(4, random)) {
    packing.seal(changed);
  }
  return changed;
}

void SealAtEnd(Bytes& input) {
  if (input.size() < kHashBytes) {
    return;
  }
  ByteWriter hash;
  hash.U64(Hash64(ByteSpan(input).first(input.size() - kHashBytes)));
  std::copy(hash.bytes().begin(), hash.bytes().end(), input.end() - kHashBytes);
}

}  // namespace atlas::fuzz
