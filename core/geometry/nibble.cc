#include "core/geometry/nibble.h"

#include <algorithm>
#include <cmath>

namespace atlas {
namespace {

// Largest evidence of states 8..14: halfway between neighbouring probabilities,
// floor(64 * logit(0.1 + 0.8 * (s - 0.5) / 14) / ln 9). Tested against the formula.
constexpr std::array<int, 7> kUpperBound = {3, 10, 17, 24, 33, 43, 55};

// By evidence + kEvidenceLimit.
constexpr auto kNibbleOf = [] {
  std::array<std::uint8_t, 2 * kEvidenceLimit + 1> nibbles{};
  for (int evidence = -kEvidenceLimit; evidence <= kEvidenceLimit; ++evidence) {
    const int magnitude = evidence < 0 ? -evidence : evidence;
    int steps = 0;
    while (steps < 7 && magnitude > kUpperBound[static_cast<std::size_t>(steps)]) {
      ++steps;
    }
    nibbles[static_cast<std::size_t>(evidence + kEvidenceLimit)] =
        static_cast<std::uint8_t>(kNibbleUnknown + (evidence < 0 ? -steps : steps));
  }
  return nibbles;
}();

}  // namespace

std::uint8_t NibbleFromEvidence(int evidence) {
  return kNibbleOf[static_cast<std::size_t>(std::clamp(evidence, -kEvidenceLimit, kEvidenceLimit) +
                                            kEvidenceLimit)];
}

double EvidenceProbability(int evidence) {
  return 1.0 / (1.0 + std::exp(-evidence * std::log(9.0) / kEvidenceLimit));
}

}  // namespace atlas
