// Where most positions have a part, whatever the others say.
#include "client/merge/plan/prior_fit.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/hash_random.h"
#include "tests/client/merge/plan/blind_session.h"

namespace atlas {
namespace {

using testing::AngleBetween;
using testing::At;
using testing::DistanceBetween;

Eigen::Vector3d Drawn(HashRandom& random) {
  const double x = random.Gaussian();
  const double y = random.Gaussian();
  return {x, y, random.Gaussian()};
}

class PriorFitTest : public ::testing::Test {
 protected:
  // Along a quarter of a circle of 200 m, each position off by half a metre.
  void Drive(std::size_t count) {
    HashRandom random(3);
    for (std::size_t i = 0; i < count; ++i) {
      const double angle_rad = 1.57 * static_cast<double>(i) / static_cast<double>(count);
      const Eigen::Vector3d place(200.0 * std::cos(angle_rad), 200.0 * std::sin(angle_rad),
                                  0.02 * static_cast<double>(i));
      pairs_.push_back({place, T_world_part_ * place + 0.5 * Drawn(random), 0.5});
    }
  }
  void Spoil(std::size_t each, double off_m) {
    HashRandom random(5);
    for (std::size_t i = 0; i < pairs_.size(); i += each) {
      pairs_[i].p_world += off_m * Drawn(random).normalized();
    }
  }
  void ExpectFound(double within_m, double within_rad) const {
    const auto pose = FitToPriors(pairs_, options_);
    ASSERT_TRUE(pose.has_value());
    const Eigen::Vector3d middle(140.0, 140.0, 0.0);
    EXPECT_LT((*pose * middle - T_world_part_ * middle).norm(), within_m);
    EXPECT_LT(AngleBetween(*pose, T_world_part_), within_rad);
    EXPECT_TRUE(pose->isApprox(*FitToPriors(pairs_, options_), 0.0)) << "the same each time";
  }

  const Pose T_world_part_ = At(-4'000.0, 73'000.0, 210.0, 2.5);
  std::vector<KnownPair> pairs_;
  PriorOptions options_;
};

TEST_F(PriorFitTest, PutsAPartWhereItIs) {
  Drive(300);
  ExpectFound(0.15, 0.001);
}

TEST_F(PriorFitTest, WrongOnesDoNotHarm) {
  Drive(300);
  Spoil(20, 20.0);
  ExpectFound(0.15, 0.001);
  Spoil(3, 500.0);  // a third of them
  ExpectFound(0.2, 0.001);
}

TEST_F(PriorFitTest, SoManyWrongOnesAreNoPlace) {
  Drive(300);
  HashRandom random(9);
  for (std::size_t i = 0; i < 180; ++i) pairs_[i].p_world += 300.0 * Drawn(random);
  EXPECT_FALSE(FitToPriors(pairs_, options_));
}

TEST_F(PriorFitTest, TooFewOrTooNearEachOtherTellNoHeading) {
  Drive(9);
  EXPECT_FALSE(FitToPriors(pairs_, options_));
  EXPECT_FALSE(FitToPriors({}, options_));
  pairs_.clear();
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d place(0.1 * i, 0.0, 0.0);
    pairs_.push_back({place, T_world_part_ * place, 0.5});
  }
  EXPECT_FALSE(FitToPriors(pairs_, options_));
  for (KnownPair& pair : pairs_) pair.radius_m = 0.05;  // they know better
  ExpectFound(1e-3, 1e-3);
}

TEST_F(PriorFitTest, AgreementGoesByTheRadius) {
  std::vector<KnownPair> pairs(3);
  for (KnownPair& pair : pairs) pair.radius_m = 1.0;
  pairs[1].p_world.x() = 5.5;
  pairs[2].p_world.z() = -6.5;
  EXPECT_EQ(CountAgreeing(pairs, At(0.0), 0.0), 1U);
  EXPECT_EQ(CountAgreeing(pairs, At(0.0), 0.5), 2U);
  EXPECT_EQ(CountAgreeing(pairs, At(0.0), 1.5), 3U);
  EXPECT_EQ(CountAgreeing(pairs, At(5.0), 0.0), 2U);
}

}  // namespace
}  // namespace atlas
