// Noise as large as it is said to be, of which a part stays as long as it is said to.
#include "core/simulation/gnss_noise.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr std::size_t kCount = 20'000;

class GnssNoiseTest : public ::testing::Test {
 protected:
  GnssNoiseTest() {
    for (std::size_t i = 0; i < kCount; ++i) {
      Pose pose = Pose::Identity();
      pose.translation() = Eigen::Vector3d(static_cast<double>(i), -5.0, 2.0);
      poses_.push_back(pose);
      times_s_.push_back(1000.0 + static_cast<double>(i));
    }
  }

  std::vector<Eigen::Vector3d> Off(const GnssOptions& options) const {
    const KnownPlaces places = MeasuredPlaces(poses_, times_s_, options);
    EXPECT_EQ(places.size(), kCount);
    std::vector<Eigen::Vector3d> off;
    for (const auto& [number, place] : places) {
      off.push_back(place.p_world - poses_[number].translation());
      EXPECT_EQ(place.radius_m, options.sigma_m);
    }
    return off;
  }
  // Of what is off at one time and so many later; along each axis.
  static Eigen::Vector3d MeanProduct(const std::vector<Eigen::Vector3d>& off, std::size_t later) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i + later < off.size(); ++i) {
      sum += off[i].cwiseProduct(off[i + later]);
    }
    return sum / static_cast<double>(off.size() - later);
  }

  std::vector<Pose> poses_;
  std::vector<double> times_s_;
};

TEST_F(GnssNoiseTest, IsAsLargeAsItsSigmaAndStaysAsLongAsItIsSaidTo) {
  for (const double wandering : {0.0, 0.5, 1.0}) {
    const auto off = Off({.sigma_m = 2.0, .wandering = wandering, .wandering_s = 10.0});
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(MeanProduct(off, 0)(axis), 4.0, 0.4) << wandering;
      for (const std::size_t later : {1U, 5U, 10U, 20U}) {
        const double stays = std::exp(-static_cast<double>(later) / 10.0);
        EXPECT_NEAR(MeanProduct(off, later)(axis), 4.0 * wandering * stays, 0.4)
            << wandering << " " << later;
      }
    }
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& one : off) mean += one / static_cast<double>(kCount);
    EXPECT_LT(mean.norm(), 0.25) << wandering;
  }
}

TEST_F(GnssNoiseTest, IsTheSameForASeed) {
  const GnssOptions options{.seed = 7};
  EXPECT_EQ(MeasuredPlaces(poses_, times_s_, options), MeasuredPlaces(poses_, times_s_, options));
  EXPECT_NE(MeasuredPlaces(poses_, times_s_, options),
            MeasuredPlaces(poses_, times_s_, {.seed = 8}));
}

TEST_F(GnssNoiseTest, OptionsOutOfRangeAreRefused) {
  EXPECT_TRUE(GnssOptions().Validate().ok());
  for (const GnssOptions& bad :
       {GnssOptions{.sigma_m = 0.0}, GnssOptions{.sigma_m = -1.0}, GnssOptions{.sigma_m = 1e4},
        GnssOptions{.sigma_m = std::nan("")}, GnssOptions{.wandering = -0.1},
        GnssOptions{.wandering = 1.1}, GnssOptions{.wandering_s = 0.0}}) {
    EXPECT_EQ(bad.Validate().code(), StatusCode::kInvalidArgument);
  }
}

}  // namespace
}  // namespace atlas
