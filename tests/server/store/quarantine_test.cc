// Sessions whose keyframes look wrong: which state they are in is a matter of what is there, and of
// what somebody said about them.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <string>

#include "tests/core/support/test_scale.h"
#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

const TileId kA{0, 0, 0};
const TileId kB{0, 1, 0};
const SessionKey kDay{"bus", "day"};

// Where and when a keyframe of the session is.
constexpr PlausibilityLimits kLimits{90.0, 250.0, 15.0, 20.0};

struct Spot {
  std::int64_t x_m = 0;
  std::int64_t time_ms = 0;
};

class QuarantineTest : public StoreTest {
 protected:
  static NewKeyframe At(std::uint32_t sequence, const Spot& spot, const std::string& session) {
    NewKeyframe keyframe = MakeKeyframe(sequence, {sequence % 2 == 0 ? kA : kB});
    keyframe.key.session.session = session;
    keyframe.time_ms = spot.time_ms;
    keyframe.pose = PoseAt(spot.x_m * 1'000'000);
    keyframe.limits = kLimits;
    return keyframe;
  }
  PutKeyframeResult PutAt(std::uint32_t sequence,
                          std::int64_t x_m,
                          const std::string& session = "day") {
    const auto put = Put(At(sequence, {x_m, 100 * std::int64_t{sequence}}, session));
    EXPECT_TRUE(put.has_value()) << put.error().message();
    return put.value_or(PutKeyframeResult());
  }
  Result<SessionChangeResult> Change(SessionAction action, const SessionKey& key = kDay) {
    return Await<SessionChangeResult>([&](auto done) {
      store_->ChangeSession({key, action, "tester", "why not", kLimits}, std::move(done));
    });
  }
  SessionState State(const std::string& session = "day") {
    return store_->FindSession({"bus", session}).value()->state;
  }
  std::string Reason() { return store_->ListSessions({}, 1'000)->at(0).reason; }
  std::size_t InTheMap(const TileId& tile) { return store_->GatherTile(tile, 0)->keyframes.size(); }
  std::vector<std::string> Events() {
    std::vector<std::string> lines;
    const auto events = store_->ListEvents(0, 1'000).value();
    for (const Event& event : events) {
      lines.push_back(std::string(EventName(event.kind)) + " by " + event.author);
    }
    return lines;
  }
  void ExpectSound(const SessionKey& key = kDay) {
    const Status session = store_->CheckSession(key);
    EXPECT_TRUE(session.ok()) << session.message();
    const Status counters = store_->CheckCounters();
    EXPECT_TRUE(counters.ok()) << counters.message();
    const auto ids = store_->ListKeyframeIds(0, 1'000).value();
    for (const std::int64_t id : ids) {
      const auto read = store_->ReadKeyframe(id);
      EXPECT_TRUE(read.has_value()) << read.error().message();
    }
  }
};

constexpr std::int64_t kFar_m = 5'000;

TEST_F(QuarantineTest, AWildKeyframeTakesItsSessionOutOfTheMapWhereverItIs) {
  for (std::uint32_t wild = 1; wild <= 5; ++wild) {
    SCOPED_TRACE(wild);
    std::filesystem::remove_all(options_.directory);
    Open();
    for (std::uint32_t i = 1; i <= 5; ++i) {
      const PutKeyframeResult put = PutAt(i, i == wild ? kFar_m : i);
      const bool is_found = i == std::max(wild, 2U);
      EXPECT_EQ(put.judgement.has_value(), is_found) << i;
      EXPECT_EQ(put.tiles_marked, is_found ? 2U : i < std::max(wild, 2U) ? 1U : 0U) << i;
    }
    EXPECT_EQ(State(), SessionState::kQuarantined);
    EXPECT_EQ(InTheMap(kA) + InTheMap(kB), 0U);
    EXPECT_EQ(store_->ReadCounts()->quarantined, 1U);
    EXPECT_EQ(store_->ReadCounts()->keyframes, 5U);
    EXPECT_NE(Reason().find(wild == 1 ? "keyframe 1 to 2: " : " to " + std::to_string(wild)),
              std::string::npos)
        << Reason();
    EXPECT_EQ(Events(), std::vector<std::string>{"session_quarantined by atlasd"});
    ExpectSound();
    store_.reset();
  }
}

TEST_F(QuarantineTest, TheRevisionThatBroughtItIsAlreadyWithoutTheSession) {
  Open();
  PutAt(2, 2);
  const std::uint64_t before = PutAt(4, 4).revision;
  const std::uint64_t found = PutAt(6, kFar_m).revision;
  EXPECT_EQ(store_->GatherTileAt(kA, before)->keyframes.size(), 2U);
  EXPECT_EQ(store_->GatherTileAt(kA, found)->keyframes.size(), 0U);
  EXPECT_EQ(store_->GatherTile(kA, before)->gone.size(), 3U);
}

TEST_F(QuarantineTest, OtherSessionsAreOthers) {
  Open();
  PutAt(2, 2);
  PutAt(4, 2, "night");
  PutAt(3, kFar_m, "dusk");
  PutAt(6, kFar_m, "night");
  EXPECT_EQ(State("day"), SessionState::kLive);
  EXPECT_EQ(State("dusk"), SessionState::kLive);
  EXPECT_EQ(State("night"), SessionState::kQuarantined);
}

TEST_F(QuarantineTest, CorrectedPosesAreNotJudgedAndDoNotCount) {
  Open();
  PutAt(2, 2);
  PutAt(4, 4);
  ASSERT_TRUE(Update({{{kDay, 4}, PoseAt(kFar_m * 1'000'000), {kA}}}).has_value());
  EXPECT_EQ(State(), SessionState::kLive);
  PutAt(5, 5);
  EXPECT_EQ(State(), SessionState::kLive) << "its neighbour was uploaded near it";
  ASSERT_TRUE(Update({{{kDay, 5}, PoseAt(kFar_m * 1'000'000), {kB}}}).has_value());
  PutAt(6, kFar_m);
  EXPECT_EQ(State(), SessionState::kQuarantined) << "its neighbour was uploaded far from it";
}

TEST_F(QuarantineTest, WithoutLimitsNobodyIsJudged) {
  Open();
  for (std::uint32_t i = 1; i <= 3; ++i) {
    NewKeyframe keyframe = At(i, {i * kFar_m, 0}, "day");
    keyframe.limits.reset();
    ASSERT_TRUE(Put(std::move(keyframe)).has_value());
  }
  EXPECT_EQ(State(), SessionState::kLive);
}

// 400 m in no time are too much; not so when no way of 8 steps has more than 250 of them.
TEST_F(QuarantineTest, ALateKeyframeMakesASessionPlausibleAgain) {
  Open();
  const auto put = [this](std::uint32_t i) {
    return *Put(At(2 * i, {25 * i, 0}, "day"));
  };
  put(0);
  EXPECT_TRUE(put(16).judgement.has_value());
  EXPECT_EQ(State(), SessionState::kQuarantined);
  for (std::uint32_t i = 1; i < 13; ++i) {
    EXPECT_FALSE(put(i).judgement.has_value()) << i;
  }
  const auto late = put(13);
  ASSERT_TRUE(late.judgement.has_value());
  EXPECT_EQ(late.judgement->state, SessionState::kLive);
  EXPECT_EQ(late.tiles_marked, 1U);
  EXPECT_EQ(State(), SessionState::kLive);
  EXPECT_EQ(Reason(), "");
  EXPECT_EQ(InTheMap(kA), 15U);
  EXPECT_EQ(Events(), (std::vector<std::string>{"session_quarantined by atlasd",
                                                "session_released by atlasd"}));
  PutAt(34, kFar_m);
  EXPECT_EQ(State(), SessionState::kQuarantined) << "the atlas released it, nobody else";
  ExpectSound();
}

TEST_F(QuarantineTest, WhatGoesTooFarInSmallStepsIsFound) {
  Open();
  for (std::uint32_t i = 1; i <= 3; ++i) {
    ASSERT_TRUE(Put(At(i, {240 * i, 100 * std::int64_t{i}}, "fast")).has_value());
    ASSERT_TRUE(Put(At(i, {240 * (i % 2), 100 * std::int64_t{i}}, "zigzag")).has_value());
    ASSERT_TRUE(Put(At(i, {24 * i, 100 * std::int64_t{i}}, "slow")).has_value());
    EXPECT_EQ(State("fast"), i < 3 ? SessionState::kLive : SessionState::kQuarantined);
    EXPECT_EQ(State("zigzag"), i < 3 ? SessionState::kLive : SessionState::kQuarantined);
  }
  EXPECT_EQ(State("slow"), SessionState::kLive);
}

// Whether any way of at most kMostJudgedSteps is longer than it may be, by what is documented.
bool IsWild(const std::vector<Spot>& spots) {
  for (std::size_t from = 0; from < spots.size(); ++from) {
    double way_m = 0.0;
    for (std::size_t to = from + 1; to < spots.size() && to <= from + kMostJudgedSteps; ++to) {
      way_m += std::abs(static_cast<double>(spots[to].x_m - spots[to - 1].x_m));
      const auto time_ms = static_cast<double>(spots[to].time_ms - spots[from].time_ms);
      if (way_m > kLimits.max_jump_m + kLimits.max_speed_mps * 1e-3 * std::abs(time_ms)) {
        return true;
      }
    }
  }
  return false;
}

class QuarantineOrderTest : public QuarantineTest {
 protected:
  // After each that arrives the session is what those that are there make of it.
  void PutInOrder(const std::vector<Spot>& spots, const std::vector<std::uint32_t>& order) {
    const std::string session = std::to_string(++sessions_);
    std::map<std::uint32_t, Spot> there;
    for (const std::uint32_t i : order) {
      const auto put = Put(At(i, spots[i], session));
      ASSERT_TRUE(put.has_value()) << put.error().message();
      released_ += put->judgement && put->judgement->state == SessionState::kLive ? 1 : 0;
      there[i] = spots[i];
      std::vector<Spot> in_sequence;
      for (const auto& [sequence, spot] : there) {
        in_sequence.push_back(spot);
      }
      ASSERT_EQ(State(session),
                IsWild(in_sequence) ? SessionState::kQuarantined : SessionState::kLive)
          << "session " << session << ", after keyframe " << i;
    }
    ++verdicts_[IsWild(spots) ? 1U : 0U];
  }
  std::int64_t Below(std::uint32_t limit) { return static_cast<std::int64_t>(random_() % limit); }
  void ExpectBothVerdicts() const {
    EXPECT_GT(verdicts_[0], 3);
    EXPECT_GT(verdicts_[1], 3);
  }

  std::mt19937 random_{7};
  int sessions_ = 0;
  int released_ = 0;
  std::array<int, 2> verdicts_{};
};

// Small sets, all orders: near and far, early and late.
TEST_F(QuarantineOrderTest, TheVerdictIsAMatterOfTheSetAlone) {
  Open();
  for (std::uint32_t set = 0; set < 24 * testing::Scaled(1); ++set) {
    std::vector<Spot> spots(4);
    for (Spot& spot : spots) {
      spot = {200 * Below(3), 1'000 * Below(6)};
    }
    std::vector<std::uint32_t> order(spots.size());
    std::iota(order.begin(), order.end(), 0U);
    do {
      ASSERT_NO_FATAL_FAILURE(PutInOrder(spots, order)) << "set " << set;
    } while (std::next_permutation(order.begin(), order.end()));
  }
  ExpectBothVerdicts();
  EXPECT_EQ(released_, 0) << "their ways are shorter than those that are judged";
}

// More than are looked at on both sides, some orders: drives of which one keyframe may be
// elsewhere.
TEST_F(QuarantineOrderTest, AndSoItIsOfLongDrives) {
  Open();
  for (std::uint32_t drive = 0; drive < 60 * testing::Scaled(1); ++drive) {
    std::vector<Spot> spots(24);
    const std::int64_t step_m = 20 + Below(14);
    const std::int64_t step_ms = 100 * Below(2);
    for (std::size_t i = 0; i < spots.size(); ++i) {
      const auto number = static_cast<std::int64_t>(i);
      spots[i] = {step_m * number, step_ms * number};
    }
    if (Below(4) == 0) {
      spots[static_cast<std::size_t>(Below(24))].x_m += Below(300);
    }
    std::vector<std::uint32_t> order(spots.size());
    std::iota(order.begin(), order.end(), 0U);
    std::shuffle(order.begin(), order.end(), random_);
    ASSERT_NO_FATAL_FAILURE(PutInOrder(spots, order)) << "drive " << drive;
  }
  ExpectBothVerdicts();
  EXPECT_GT(released_, 3);
}

TEST_F(QuarantineTest, ReleasedIsForGood) {
  Open();
  PutAt(2, 2);
  PutAt(4, kFar_m);
  const auto released = Change(SessionAction::kRelease);
  ASSERT_TRUE(released.has_value()) << released.error().message();
  EXPECT_EQ(released->state, SessionState::kReleased);
  EXPECT_EQ(released->tiles_marked, 1U);
  EXPECT_EQ(InTheMap(kA), 2U);
  EXPECT_FALSE(Change(SessionAction::kRelease)->is_changed);
  Open();
  EXPECT_EQ(PutAt(6, -kFar_m).tiles_marked, 1U);
  EXPECT_EQ(PutAt(8, kFar_m).judgement.has_value(), false);
  EXPECT_EQ(InTheMap(kA), 4U);
  ASSERT_TRUE(Change(SessionAction::kRetract).has_value());
  EXPECT_EQ(InTheMap(kA), 0U);
  EXPECT_EQ(Change(SessionAction::kRestore)->state, SessionState::kReleased);
  EXPECT_EQ(InTheMap(kA), 4U);
  EXPECT_EQ(Reason(), "why not");
  EXPECT_EQ(Events(),
            (std::vector<std::string>{"session_quarantined by atlasd", "session_released by tester",
                                      "retract by tester", "restore by tester"}));
  ExpectSound();
}

TEST_F(QuarantineTest, ALiveSessionCanBeReleasedBefore) {
  Open();
  PutAt(2, 2);
  const auto released = Change(SessionAction::kRelease);
  EXPECT_TRUE(released->is_changed);
  EXPECT_EQ(released->tiles_marked, 0U);
  PutAt(4, kFar_m);
  EXPECT_EQ(State(), SessionState::kReleased);
  EXPECT_EQ(InTheMap(kA), 2U);
  ExpectSound();
}

TEST_F(QuarantineTest, RetractedFromQuarantineItIsJudgedAnewWhenItIsRestored) {
  Open();
  ASSERT_TRUE(Put(At(20, {0, 0}, "day")).has_value());
  ASSERT_TRUE(Put(At(52, {400, 0}, "day")).has_value());
  const auto retracted = Change(SessionAction::kRetract);
  ASSERT_TRUE(retracted.has_value()) << retracted.error().message();
  EXPECT_TRUE(retracted->is_changed);
  EXPECT_EQ(retracted->tiles_marked, 0U) << "it was not in the map";
  EXPECT_EQ(Change(SessionAction::kRelease).error().code(), StatusCode::kConflict);
  const auto restored = Change(SessionAction::kRestore);
  EXPECT_EQ(restored->state, SessionState::kQuarantined);
  EXPECT_NE(Reason().find("keyframe 20 to 52: 400 m in 0.00 s"), std::string::npos) << Reason();
  ASSERT_TRUE(Change(SessionAction::kRetract).has_value());
  for (std::uint32_t i = 1; i < 16; ++i) {
    EXPECT_FALSE(Put(At(20 + 2 * i, {25 * i, 0}, "day"))->judgement.has_value());
  }
  EXPECT_EQ(State(), SessionState::kRetracted);
  EXPECT_EQ(Change(SessionAction::kRestore)->state, SessionState::kLive);
  EXPECT_EQ(InTheMap(kA), 17U);
  ASSERT_TRUE(Change(SessionAction::kRetract).has_value());
  PutAt(99, kFar_m);
  EXPECT_EQ(Change(SessionAction::kRestore)->state, SessionState::kQuarantined);
  ExpectSound();
}

TEST_F(QuarantineTest, RetractedFromQuarantineItStillSaysWhyItWasThere) {
  const auto retract = [this](const std::string& why) {
    ASSERT_TRUE(Await<SessionChangeResult>([&](auto done) {
      store_->ChangeSession({kDay, SessionAction::kRetract, "tester", why, kLimits},
                            std::move(done));
    }));
  };
  Open();
  ASSERT_TRUE(Put(At(20, {0, 0}, "day")).has_value());
  retract("not yet");
  EXPECT_EQ(Reason(), "not yet");
  ASSERT_TRUE(Change(SessionAction::kRestore).has_value());
  ASSERT_TRUE(Put(At(52, {400, 0}, "day")).has_value());
  const std::string quarantined = Reason();
  ASSERT_EQ(quarantined.rfind("keyframe 20 to 52: ", 0), 0U) << quarantined;
  retract("");
  EXPECT_EQ(Reason(), "was quarantined: " + quarantined);
  ASSERT_TRUE(Change(SessionAction::kRestore).has_value());
  EXPECT_EQ(Reason(), quarantined);
  retract("broken odometer");
  EXPECT_EQ(Reason(), "broken odometer; was quarantined: " + quarantined);
  for (std::uint32_t i = 1; i < 16; ++i) {
    ASSERT_TRUE(Put(At(20 + 2 * i, {25 * i, 0}, "day")).has_value());
  }
  ASSERT_EQ(Change(SessionAction::kRestore)->state, SessionState::kLive);
  retract("once more");
  EXPECT_EQ(Reason(), "once more") << "it was in the map";
}

TEST_F(QuarantineTest, ARestoreDoesNotReleaseAndAVehicleIsNotReleasedAsAWhole) {
  Open();
  PutAt(2, 2);
  PutAt(4, kFar_m);
  EXPECT_FALSE(Change(SessionAction::kRestore)->is_changed);
  EXPECT_EQ(Change(SessionAction::kRetract, {"bus", ""})->sessions, 1U);
  EXPECT_EQ(Change(SessionAction::kRestore, {"bus", ""})->state, SessionState::kQuarantined);
}

// What a compaction dropped was between them, and nobody knows where.
TEST_F(QuarantineTest, NobodyJudgesOverWhatACompactionDropped) {
  Open();
  ASSERT_TRUE(Put(At(2, {0, 0}, "day")).has_value());
  ASSERT_TRUE(Put(At(4, {100, 0}, "day")).has_value());
  ASSERT_TRUE(Put(At(6, {200, 0}, "day")).has_value());
  ASSERT_TRUE(Await<CompactionResult>([&](auto done) {
                store_->Compact({Dirty().revision, 5'000, {2}, "tester"}, std::move(done));
              }).has_value());
  ASSERT_TRUE(Put(At(8, {400, 0}, "day")).has_value());
  EXPECT_EQ(State(), SessionState::kLive);
  ASSERT_TRUE(Change(SessionAction::kRetract).has_value());
  EXPECT_EQ(Change(SessionAction::kRestore)->state, SessionState::kLive);
  EXPECT_TRUE(Put(At(7, {0, 0}, "day"))->judgement.has_value());
}

}  // namespace
}  // namespace atlas
