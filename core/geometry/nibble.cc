#include "core/geometry/nibble.h"

#include <algorithm>
#include <cmath>

namespace atlas {
namespace {

// Largest evidence of states 8..14: halfway between neighbouring probabilities,
// floor(64 * logit(0.1 + 0.8 * (s - 0.5) / 14) / ln 9). Tested against the formula.
constexpr std::array<int, 7> kUpperBound = {3, 10, 17, 24, 33, 43, 55};

}  // namespace

std::uint8_t NibbleFromEvidence(int evidence) {
  const int magnitude = std::min(std::abs(evidence), kEvidenceLimit);
  int steps = 0;
  while (steps < 7 && magnitude > kUpperBound[static_cast<std::size_t>(steps)]) {
    ++steps;
  }
  return static_cast<std::uint8_t>(evidence < 0 ? kNibbleUnknown - steps : kNibbleUnknown + steps);
}

double EvidenceProbability(int evidence) {
  return 1.0 / (1.0 + std::exp(-evidence * std::log(9.0) / kEvidenceLimit));
}

}  // namespace atlas
