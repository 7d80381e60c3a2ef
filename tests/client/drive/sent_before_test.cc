#include "client/drive/sent_before.h"

#include <vector>

#include <gtest/gtest.h>

namespace atlas {
namespace {

// Ten keyframes a second, numbers 0, 2, 4, ...
std::vector<PlannedKeyframe> Drive(std::uint32_t count, const std::string& session = "monday") {
  std::vector<PlannedKeyframe> planned;
  for (std::uint32_t i = 0; i < count; ++i) {
    planned.push_back({{{"car", session}, 2 * i}, 1'000 + 200 * std::int64_t{i}});
  }
  return planned;
}

// As the daemon tells it, of the first `count`.
SessionSummary Stored(std::uint32_t count, const std::string& session = "monday") {
  SessionSummary summary;
  summary.key = {"car", session};
  summary.keyframes = count;
  summary.first_time_ms = 1'000;
  summary.last_time_ms = 1'000 + 200 * (std::int64_t{count} - 1);
  summary.last_sequence = 2 * (count - 1);
  return summary;
}

std::size_t CountWith(const std::vector<PlannedKeyframe>& planned,
                      const std::vector<SessionSummary>& sessions) {
  return CountSentBefore(planned, sessions);
}

TEST(SentBeforeTest, CountsUpToTheLastOne) {
  EXPECT_EQ(CountWith(Drive(100), {}), 0U);
  EXPECT_EQ(CountWith(Drive(100), {Stored(40)}), 40U);
  EXPECT_EQ(CountWith(Drive(100), {Stored(3)}), 3U);
  EXPECT_EQ(CountWith(Drive(100), {Stored(40, "tuesday")}), 0U);
}

TEST(SentBeforeTest, WhatIsThereAsAWholeIsSentAgain) {
  EXPECT_EQ(CountWith(Drive(100), {Stored(100)}), 0U);
  EXPECT_EQ(CountWith({}, {Stored(100)}), 0U);
}

TEST(SentBeforeTest, TheLastOfASessionIsThereForCertain) {
  using Indices = std::vector<std::size_t>;
  EXPECT_EQ(FindThere(Drive(100), {}), Indices{});
  const std::vector<SessionSummary> stored{Stored(40), Stored(200, "tuesday")};
  EXPECT_EQ(FindThere(Drive(100), stored), Indices{39});
  EXPECT_EQ(FindThere(Drive(100, "tuesday"), stored), Indices{}) << "it is not one of ours";
  SessionSummary none = Stored(1);
  none.keyframes = 0;
  EXPECT_EQ(FindThere(Drive(100), std::vector{none}), Indices{});
}

TEST(SentBeforeTest, CompactedOnesWereThere) {
  SessionSummary stored = Stored(40);
  stored.keyframes = 10;
  stored.compacted = 30;
  EXPECT_EQ(CountWith(Drive(100), {stored}), 40U);
}

// A shuffled upload, a part of the scans, other scans: up to the last one something is missing.
TEST(SentBeforeTest, AnotherSelectionIsSentAsAWhole) {
  SessionSummary gap = Stored(40);
  --gap.keyframes;
  EXPECT_EQ(CountWith(Drive(100), {gap}), 0U);
  SessionSummary more = Stored(40);
  ++more.keyframes;
  EXPECT_EQ(CountWith(Drive(100), {more}), 0U);
  SessionSummary later = Stored(40);
  later.first_time_ms += 100;
  EXPECT_EQ(CountWith(Drive(100), {later}), 0U);
  SessionSummary other_time = Stored(40);
  other_time.last_time_ms += 1;
  EXPECT_EQ(CountWith(Drive(100), {other_time}), 0U);
}

TEST(SentBeforeTest, GoesOnInALaterPart) {
  std::vector<PlannedKeyframe> planned = Drive(50);
  for (const PlannedKeyframe& keyframe : Drive(50, "monday.2")) {
    planned.push_back(keyframe);
  }
  EXPECT_EQ(CountWith(planned, {Stored(50), Stored(30, "monday.2")}), 80U);
  EXPECT_EQ(CountWith(planned, {Stored(50)}), 50U);
  EXPECT_EQ(CountWith(planned, {Stored(20), Stored(30, "monday.2")}), 20U);
}

}  // namespace
}  // namespace atlas
