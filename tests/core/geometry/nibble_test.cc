#include "core/geometry/nibble.h"

#include <cmath>
#include <cstdlib>

#include <gtest/gtest.h>

namespace atlas {
namespace {

double Logit(double p) {
  return std::log(p / (1.0 - p));
}

TEST(NibbleTest, EvidenceIsTheRoundedLogOdds) {
  for (std::uint8_t state = 1; state <= 15; ++state) {
    const double expected = kEvidenceLimit * Logit(NibbleProbability(state)) / std::log(9.0);
    EXPECT_EQ(kNibbleEvidence[state], std::lround(expected)) << int{state};
  }
}

TEST(NibbleTest, StatesReadBackFromTheirEvidence) {
  for (std::uint8_t state = 1; state <= 15; ++state) {
    EXPECT_EQ(NibbleFromEvidence(kNibbleEvidence[state]), state);
  }
}

TEST(NibbleTest, EvidenceGoesToTheNearestProbability) {
  for (int evidence = -kEvidenceLimit; evidence <= kEvidenceLimit; ++evidence) {
    const double p = EvidenceProbability(evidence);
    const double distance = std::abs(NibbleProbability(NibbleFromEvidence(evidence)) - p);
    for (std::uint8_t state = 1; state <= 15; ++state) {
      EXPECT_GE(std::abs(NibbleProbability(state) - p) + 1e-12, distance) << evidence;
    }
  }
}

TEST(NibbleTest, EvidenceBeyondTheLimitIsClamped) {
  EXPECT_EQ(NibbleFromEvidence(1'000), 15);
  EXPECT_EQ(NibbleFromEvidence(-1'000), 1);
  EXPECT_NEAR(EvidenceProbability(kEvidenceLimit), 0.9, 1e-12);
  EXPECT_NEAR(EvidenceProbability(0), 0.5, 1e-12);
}

TEST(NibbleTest, OneReturnAndOneMissStandForThePapersProbabilities) {
  EXPECT_NEAR(NibbleProbability(kNibbleHit), 0.7, 0.03);
  EXPECT_NEAR(NibbleProbability(kNibbleMiss), 0.4, 0.03);
  EXPECT_DOUBLE_EQ(NibbleProbability(kNibbleUnknown), 0.5);
}

}  // namespace
}  // namespace atlas
