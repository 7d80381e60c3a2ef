#include "core/fusion/column_evidence.h"

namespace atlas {
namespace {

using NibblePair = std::array<std::int16_t, 2>;

// Two nibbles at a time.
constexpr std::array<NibblePair, 256> MakePairs() {
  std::array<NibblePair, 256> pairs{};
  for (std::size_t byte = 0; byte < pairs.size(); ++byte) {
    pairs[byte] = {kNibbleEvidence[byte & 15], kNibbleEvidence[byte >> 4]};
  }
  return pairs;
}
constexpr std::array<NibblePair, 256> kPairs = MakePairs();

}  // namespace

ColumnEvidence EvidenceOfNibbles(std::uint64_t nibbles) {
  ColumnEvidence column;
  column.seen = nibbles;
  for (std::size_t k = 0; nibbles != 0; k += 2) {
    const NibblePair& pair = kPairs[nibbles & 255];
    column.evidence[k] = pair[0];
    column.evidence[k + 1] = pair[1];
    nibbles >>= 8;
  }
  return column;
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
