// Submaps of a street are found by what they look like, also by who comes turned around.
#include "core/alignment/place_search.h"

#include <algorithm>
#include <memory>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/core/support/simulated_keyframes.h"

namespace atlas {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// Pieces of a drive after each other, as submaps.
class StreetSubmaps {
  static constexpr std::size_t kKeyframes = 7;  // of each: the middle one is between two places

 public:
  StreetSubmaps(std::uint64_t seed, std::size_t first, std::size_t count) {
    const testing::DrivenKeyframes driven = testing::DriveThrough(
        {.seed = seed, .first = first, .count = kKeyframes * count}, profile_);
    for (std::size_t k = 0; k < count; ++k) {
      std::vector<SubmapMember> members;
      for (std::size_t i = kKeyframes * k; i < kKeyframes * (k + 1); ++i) {
        const auto sequence = static_cast<std::uint32_t>(i);
        members.push_back({{{"car", "drive"}, sequence},
                           250 * static_cast<std::int64_t>(sequence),
                           driven.T_world_sensor[i],
                           driven.keyframes[i]});
      }
      const std::uint64_t number = 100 * seed + k;
      T_world_submap_.push_back(SubmapFrame(members, number));
      submaps_.push_back(Submap::Fuse(members, number, profile_, {}).value());
    }
  }

  std::vector<SubmapPlaces> all() const {
    std::vector<SubmapPlaces> all;
    for (const Submap& submap : submaps_) all.emplace_back(submap.places());
    return all;
  }
  const Submap& operator[](std::size_t i) const { return submaps_[i]; }
  const Pose& T_world(std::size_t i) const { return T_world_submap_[i]; }

 private:
  MapProfile profile_;
  std::vector<Pose> T_world_submap_;
  std::vector<Submap> submaps_;
};

bool Any(std::size_t) {
  return true;
}

class PlaceSearchTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    street_ = std::make_unique<StreetSubmaps>(0, 40, 5);
    again_ = std::make_unique<StreetSubmaps>(2, 59, 1);  // where the fourth one begins
  }
  static void TearDownTestSuite() {
    street_.reset();
    again_.reset();
  }

  static std::vector<SubmapCandidate> Search(const std::function<bool(std::size_t)>& may_be,
                                             const PlaceSearchOptions& options = {}) {
    return SearchPlaces(street_->all(), (*again_)[0].places(), may_be, options);
  }

  inline static std::unique_ptr<StreetSubmaps> street_;
  inline static std::unique_ptr<StreetSubmaps> again_;
};

TEST_F(PlaceSearchTest, TheLikestIsWhereItIs) {
  const std::vector<SubmapCandidate> candidates = Search(Any);
  ASSERT_FALSE(candidates.empty());
  const SubmapCandidate& best = candidates.front();
  EXPECT_TRUE(best.submap == 2 || best.submap == 3) << best.submap;
  const Pose truth = street_->T_world(best.submap).inverse() * again_->T_world(0);
  const Pose off = truth.inverse() * best.T_submap_searcher;
  EXPECT_LT(off.translation().norm(), 2.0);
  EXPECT_LT(Eigen::AngleAxisd(off.linear()).angle(), 3.0 * kDegree);
}

TEST_F(PlaceSearchTest, TheSearchersMiddlePlaceLiesOnOneOfTheSubmaps) {
  const std::vector<SubmapPlace>& places = (*again_)[0].places();
  const Eigen::Vector3d& here = places[places.size() / 2].ground;
  ASSERT_GT(here.head<2>().norm(), 0.1);
  for (const SubmapCandidate& candidate : Search(Any)) {
    const Eigen::Vector3d there = candidate.T_submap_searcher * here;
    double nearest_m = 1e9;
    for (const SubmapPlace& place : (*street_)[candidate.submap].places()) {
      nearest_m = std::min(nearest_m, (place.ground - there).norm());
    }
    EXPECT_LT(nearest_m, 1e-9);
  }
}

TEST_F(PlaceSearchTest, EachSubmapComesOnceTheLikestFirst) {
  const std::vector<SubmapCandidate> candidates = Search(Any, {.max_difference = 3'000});
  ASSERT_GT(candidates.size(), 1U);
  std::vector<bool> was_seen(5, false);
  std::uint32_t before = 0;
  for (const SubmapCandidate& candidate : candidates) {
    EXPECT_FALSE(was_seen[candidate.submap]);
    was_seen[candidate.submap] = true;
    EXPECT_GE(candidate.difference, before);
    EXPECT_LT(candidate.difference, 3'000U);
    before = candidate.difference;
  }
}

TEST_F(PlaceSearchTest, WhatMayNotBeIsNotLookedAt) {
  std::vector<std::size_t> asked;
  const auto candidates = Search([&](std::size_t i) {
    asked.push_back(i);
    return i != 2;
  });
  EXPECT_EQ(asked, (std::vector<std::size_t>{0, 1, 2, 3, 4}));
  for (const SubmapCandidate& candidate : candidates) EXPECT_NE(candidate.submap, 2U);
}

TEST_F(PlaceSearchTest, KeepsToItsLimits) {
  const std::vector<SubmapCandidate> all = Search(Any, {.max_difference = 3'000});
  ASSERT_GT(all.size(), 1U);
  ASSERT_LT(all[0].difference, all[1].difference);
  const std::vector<SubmapCandidate> one = Search(Any, {.candidates = 1, .max_difference = 3'000});
  ASSERT_EQ(one.size(), 1U);
  EXPECT_EQ(one[0].submap, all[0].submap);
  EXPECT_TRUE(Search(Any, {.max_difference = all[0].difference}).empty());
  EXPECT_EQ(Search(Any, {.max_difference = all[0].difference + 1}).size(), 1U);
}

TEST_F(PlaceSearchTest, ItselfIsTheLikestOfAllAndNotTurned) {
  for (std::size_t i = 0; i < 5; ++i) {
    const auto candidates = SearchPlaces(street_->all(), (*street_)[i].places(), Any, {});
    ASSERT_FALSE(candidates.empty());
    EXPECT_EQ(candidates[0].submap, i);
    EXPECT_EQ(candidates[0].difference, 0U);
    EXPECT_TRUE(candidates[0].T_submap_searcher.isApprox(Pose::Identity(), 1e-9));
  }
}

TEST_F(PlaceSearchTest, NothingIsFoundInNothing) {
  EXPECT_TRUE(SearchPlaces({}, (*again_)[0].places(), Any, {}).empty());
}

}  // namespace
}  // namespace atlas
