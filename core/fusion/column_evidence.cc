#include "core/fusion/column_evidence.h"

#include <bit>
#include <cstring>

#include "core/geometry/nibble.h"

namespace atlas {
namespace {

static_assert(std::endian::native == std::endian::little, "lanes below are packed that way");

// Eight segments at a time, in one register where the machine has them.
using Lanes = std::int16_t __attribute__((vector_size(16)));
constexpr std::size_t kLanes = 8;

constexpr std::int16_t EvidenceOfState(std::size_t state) {
  return kNibbleEvidence[state];
}

// The evidence of two nibbles, low one in the low half.
constexpr std::array<std::uint32_t, 256> MakePairs() {
  std::array<std::uint32_t, 256> pairs{};
  for (std::size_t byte = 0; byte < pairs.size(); ++byte) {
    const std::int16_t low = EvidenceOfState(byte & 15);
    const std::int16_t high = EvidenceOfState(byte >> 4);
    pairs[byte] = static_cast<std::uint16_t>(low) |
                  (static_cast<std::uint32_t>(static_cast<std::uint16_t>(high)) << 16);
  }
  return pairs;
}
constexpr std::array<std::uint32_t, 256> kPairs = MakePairs();

// The evidence of eight nibbles.
Lanes LanesOf(std::uint32_t nibbles) {
  const std::array<std::uint64_t, 2> halves = {
      kPairs[nibbles & 255] | (std::uint64_t{kPairs[(nibbles >> 8) & 255]} << 32),
      kPairs[(nibbles >> 16) & 255] | (std::uint64_t{kPairs[nibbles >> 24]} << 32)};
  return std::bit_cast<Lanes>(halves);
}

// Sums stay within 16 bits: each is at most 127 + 127.
void AddLanes(Lanes added, std::int16_t clamp, std::int16_t* evidence) {
  Lanes sum;
  std::memcpy(&sum, evidence, sizeof(sum));
  sum += added;
  const Lanes high = Lanes{} + clamp;
  const Lanes low = -high;
  sum = sum > high ? high : sum;
  sum = sum < low ? low : sum;
  std::memcpy(evidence, &sum, sizeof(sum));
}

}  // namespace

void ColumnEvidence::AddNibbles(std::uint64_t nibbles, std::int16_t clamp) {
  seen |= nibbles;
  AddLanes(LanesOf(static_cast<std::uint32_t>(nibbles)), clamp, evidence.data());
  if ((nibbles >> 32) != 0) {
    AddLanes(LanesOf(static_cast<std::uint32_t>(nibbles >> 32)), clamp, evidence.data() + kLanes);
  }
}

void ColumnEvidence::Add(const ColumnEvidence& other, std::int16_t clamp) {
  seen |= other.seen;
  for (std::size_t half = 0; half < kSegments; half += kLanes) {
    Lanes added;
    std::memcpy(&added, other.evidence.data() + half, sizeof(added));
    AddLanes(added, clamp, evidence.data() + half);
  }
}

std::uint64_t NibblesOfEvidence(const ColumnEvidence& column) {
  std::uint64_t nibbles = 0;
  for (std::size_t k = 0; k < ColumnEvidence::kSegments; ++k) {
    if (((column.seen >> (4 * k)) & 15) != 0) {
      nibbles |= std::uint64_t{NibbleFromEvidence(column.evidence[k])} << (4 * k);
    }
  }
  return nibbles;
}

}  // namespace atlas
