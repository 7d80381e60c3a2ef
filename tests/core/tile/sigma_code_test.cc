#include "core/tile/sigma_code.h"

#include <cmath>
#include <cstdlib>

#include <gtest/gtest.h>

namespace atlas {
namespace {

TEST(SigmaCodeTest, CodesReadBackAndRise) {
  for (unsigned code = 0; code <= kMaxSigmaCode; ++code) {
    const auto byte = static_cast<std::uint8_t>(code);
    EXPECT_EQ(CodeOfSigma(SigmaOfCode(byte)), code);
    if (code > 0) {
      EXPECT_GT(SigmaOfCode(byte), SigmaOfCode(static_cast<std::uint8_t>(code - 1)));
    }
  }
}

TEST(SigmaCodeTest, RoundsToTheNearestWithinThreePercent) {
  for (unsigned sigma = 1; sigma <= 63'488; ++sigma) {
    const std::uint8_t code = CodeOfSigma(sigma);
    const int distance = std::abs(static_cast<int>(SigmaOfCode(code)) - static_cast<int>(sigma));
    EXPECT_LE(distance, 0.032 * sigma) << sigma;
    for (const int other : {code - 1, code + 1}) {
      if (other >= 0 && other <= kMaxSigmaCode) {
        const int neighbour = SigmaOfCode(static_cast<std::uint8_t>(other));
        EXPECT_LE(distance, std::abs(neighbour - static_cast<int>(sigma))) << sigma;
      }
    }
  }
}

TEST(SigmaCodeTest, EndsAreClamped) {
  EXPECT_EQ(RoundSigma100um(0), 1);
  EXPECT_EQ(RoundSigma100um(1'000'000'000), 63'488);
}

}  // namespace
}  // namespace atlas
