#include "core/localization/tracking/place_hypotheses.h"

#include <vector>

#include <gtest/gtest.h>

namespace atlas {
namespace {

PlaceHypothesis At(double x_m, double log_likelihood) {
  PlaceHypothesis place;
  place.registration.T_world_level.translation().x() = x_m;
  place.log_likelihood = log_likelihood;
  return place;
}

TEST(PlaceHypothesesTest, ARivalIsElsewhereAndAboutAsLikely) {
  const PlaceHypothesis best = At(0.0, 10.0);
  const auto rival_of = [&](const PlaceHypothesis& other) {
    return RivalOf({best, other}, best, HypothesisOptions());
  };
  EXPECT_FALSE(rival_of(At(0.5, 10.0))) << "the same place";
  EXPECT_FALSE(rival_of(At(2.5, 8.5))) << "less likely";
  const auto rival = rival_of(At(2.5, 9.5));
  ASSERT_TRUE(rival);
  EXPECT_TRUE(rival->isApprox(Eigen::Vector2d(2.5, 0.0)));
}

TEST(PlaceHypothesesTest, OfRivalsTheLikeliestCounts) {
  const PlaceHypothesis best = At(0.0, 10.0);
  const auto rival =
      RivalOf({At(2.5, 9.5), At(-5.0, 9.9), At(7.5, 9.2), best}, best, HypothesisOptions());
  ASSERT_TRUE(rival);
  EXPECT_TRUE(rival->isApprox(Eigen::Vector2d(-5.0, 0.0)));
}

TEST(PlaceHypothesesTest, APlaceStandsOutAboveWhatWasTrackedAndAboveAllOthers) {
  const PlaceHypothesis tracked = At(0.0, 10.0);
  const auto stands_out = [&](const std::vector<PlaceHypothesis>& others) {
    std::vector<PlaceHypothesis> places{tracked};
    places.insert(places.end(), others.begin(), others.end());
    return StandsOut(places, places[1], HypothesisOptions());
  };
  EXPECT_TRUE(stands_out({At(3.0, 12.5)}));
  EXPECT_FALSE(stands_out({At(3.0, 11.5)})) << "hardly likelier than where it was tracked to";
  EXPECT_FALSE(stands_out({At(3.0, 12.5), At(6.0, 12.0)})) << "one of two";
  EXPECT_TRUE(stands_out({At(3.0, 12.5), At(3.4, 12.4)})) << "twice the same";
}

}  // namespace
}  // namespace atlas
