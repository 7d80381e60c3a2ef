// Scans that may be in several places, and the transforms that some of them agree on.
#include "client/drive/anchor/anchor_guess.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// Scan `index`, 4 m behind the one before, where a transform puts it.
AnchorGuess Guess(std::size_t index, const LevelTransform& T_map_drive, bool is_believed) {
  AnchorGuess guess;
  guess.index = index;
  guess.scan.T_drive_sensor.translation().x() = 4.0 * static_cast<double>(index);
  guess.scan.T_map_sensor = T_map_drive.ToPose() * guess.scan.T_drive_sensor;
  guess.is_believed = is_believed;
  return guess;
}

const LevelTransform kHere{0.0, {100.0, 0.0, 0.0}};
const LevelTransform kMirrored{180.0 * kDegree, {-100.0, 50.0, 0.0}};
const LevelTransform kElsewhere{40.0 * kDegree, {0.0, -30.0, 5.0}};

std::vector<std::vector<AnchorGuess>> Candidates(const std::vector<AnchorGuess>& guesses,
                                                 std::size_t most = 4) {
  return CandidatesOf(guesses, {}, 3, most);
}

TEST(AnchorGuessTest, BelievedOnesComeFirstHoweverManyLookAlike) {
  std::vector<AnchorGuess> guesses;
  for (std::size_t i = 0; i < 10; ++i) {
    if (i < 4) guesses.push_back(Guess(i, kHere, true));
    guesses.push_back(Guess(i, kMirrored, false));
  }
  const auto candidates = Candidates(guesses);
  ASSERT_EQ(candidates.size(), 2U);
  EXPECT_EQ(candidates[0].size(), 4U);
  EXPECT_TRUE(candidates[0].front().is_believed);
  EXPECT_EQ(candidates[1].size(), 10U);
}

TEST(AnchorGuessTest, WhatAgreesWithTheBelievedOnesIsNoRival) {
  std::vector<AnchorGuess> guesses;
  for (std::size_t i = 0; i < 10; ++i) {
    guesses.push_back(Guess(i, kHere, i % 3 == 0));
  }
  EXPECT_EQ(Candidates(guesses).size(), 1U);
}

TEST(AnchorGuessTest, ARivalTakesSeveralScans) {
  std::vector<AnchorGuess> guesses;
  for (std::size_t i = 0; i < 6; ++i) {
    guesses.push_back(Guess(i, kHere, true));
  }
  guesses.push_back(Guess(1, kMirrored, false));
  guesses.push_back(Guess(2, kMirrored, false));
  guesses.push_back(Guess(2, kMirrored, false));  // another guess, but the same scan
  EXPECT_EQ(Candidates(guesses).size(), 1U);
  guesses.push_back(Guess(4, kMirrored, false));
  EXPECT_EQ(Candidates(guesses).size(), 2U);
}

TEST(AnchorGuessTest, BelievedOnesThatLieElsewhereAreARival) {
  std::vector<AnchorGuess> guesses;
  for (std::size_t i = 0; i < 5; ++i) {
    guesses.push_back(Guess(i, kHere, true));
    guesses.push_back(Guess(i + 5, kMirrored, i < 3));
    guesses.push_back(Guess(i + 10, kElsewhere, false));
  }
  const auto candidates = Candidates(guesses);
  ASSERT_EQ(candidates.size(), 3U);
  EXPECT_EQ(candidates[0].front().index, 0U);
  EXPECT_EQ(Candidates(guesses, 2).size(), 2U);
}

TEST(AnchorGuessTest, WithoutABelievedOneTheFirstIsEmpty) {
  EXPECT_TRUE(Candidates({}).front().empty());
  const auto candidates =
      Candidates({Guess(0, kHere, false), Guess(1, kHere, false), Guess(2, kHere, false)});
  ASSERT_EQ(candidates.size(), 2U);
  EXPECT_TRUE(candidates[0].empty());
  EXPECT_EQ(candidates[1].size(), 3U);
}

}  // namespace
}  // namespace atlas
