// Sessions whose keyframes look wrong: which state they are in is a matter of what is there, and of
// what somebody said about them.
#include <algorithm>
#include <array>
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

// 400 m in no time is too much; not so with one between them.
TEST_F(QuarantineTest, ALateKeyframeMakesASessionPlausibleAgain) {
  Open();
  ASSERT_TRUE(Put(At(2, {0, 0}, "day")).has_value());
  EXPECT_TRUE(Put(At(6, {400, 0}, "day"))->judgement.has_value());
  EXPECT_EQ(State(), SessionState::kQuarantined);
  const auto late = Put(At(4, {200, 0}, "day"));
  ASSERT_TRUE(late->judgement.has_value());
  EXPECT_EQ(late->judgement->state, SessionState::kLive);
  EXPECT_EQ(late->tiles_marked, 1U);
  EXPECT_EQ(State(), SessionState::kLive);
  EXPECT_EQ(Reason(), "");
  EXPECT_EQ(InTheMap(kA), 3U);
  EXPECT_EQ(Events(), (std::vector<std::string>{"session_quarantined by atlasd",
                                                "session_released by atlasd"}));
  PutAt(8, kFar_m);
  EXPECT_EQ(State(), SessionState::kQuarantined) << "the atlas released it, nobody else";
  ExpectSound();
}

// Small sets, all orders: near and far, early and late. The verdict is that of all neighbours.
TEST_F(QuarantineTest, TheVerdictIsAMatterOfTheSetAlone) {
  constexpr std::size_t kCount = 4;
  const auto is_wild = [](const std::vector<Spot>& spots) {
    bool is_any = false;
    for (std::uint32_t i = 0; i + 1 < spots.size(); ++i) {
      const auto place = [&spots](std::uint32_t at) {
        return UploadedPlace{at, spots[at].time_ms, spots[at].x_m * 1'000'000, 0, 0};
      };
      is_any = is_any || FindImplausible(place(i), place(i + 1), kLimits);
    }
    return is_any;
  };
  Open();
  std::mt19937 random(7);
  int number = 0;
  std::array<int, 2> verdicts{};
  int released = 0;
  for (std::uint32_t set = 0; set < 24 * testing::Scaled(1); ++set) {
    std::vector<Spot> spots(kCount);
    for (Spot& spot : spots) {
      spot.x_m = static_cast<std::int64_t>(200 * (random() % 4));
      spot.time_ms = static_cast<std::int64_t>(1'000 * (random() % 3));
    }
    std::vector<std::uint32_t> order(kCount);
    std::iota(order.begin(), order.end(), 0U);
    ++verdicts[is_wild(spots) ? 1U : 0U];
    do {
      const std::string session = std::to_string(++number);
      for (const std::uint32_t i : order) {
        const auto put = Put(At(i, spots[i], session));
        ASSERT_TRUE(put.has_value()) << put.error().message();
        released += put->judgement && put->judgement->state == SessionState::kLive ? 1 : 0;
      }
      ASSERT_EQ(State(session), is_wild(spots) ? SessionState::kQuarantined : SessionState::kLive)
          << "set " << set << ", order " << order[0] << order[1] << order[2] << order[3];
    } while (std::next_permutation(order.begin(), order.end()));
  }
  EXPECT_GT(verdicts[0], 3);
  EXPECT_GT(verdicts[1], 3);
  EXPECT_GT(released, 3);
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
  ASSERT_TRUE(Put(At(2, {0, 0}, "day")).has_value());
  ASSERT_TRUE(Put(At(6, {400, 0}, "day")).has_value());
  const auto retracted = Change(SessionAction::kRetract);
  ASSERT_TRUE(retracted.has_value()) << retracted.error().message();
  EXPECT_TRUE(retracted->is_changed);
  EXPECT_EQ(retracted->tiles_marked, 0U) << "it was not in the map";
  EXPECT_EQ(Change(SessionAction::kRelease).error().code(), StatusCode::kConflict);
  const auto restored = Change(SessionAction::kRestore);
  EXPECT_EQ(restored->state, SessionState::kQuarantined);
  EXPECT_NE(Reason().find("keyframe 2 to 6: 400 m in 0.00 s"), std::string::npos) << Reason();
  ASSERT_TRUE(Change(SessionAction::kRetract).has_value());
  EXPECT_FALSE(Put(At(4, {200, 0}, "day"))->judgement.has_value());
  EXPECT_EQ(State(), SessionState::kRetracted);
  EXPECT_EQ(Change(SessionAction::kRestore)->state, SessionState::kLive);
  EXPECT_EQ(InTheMap(kA), 3U);
  ASSERT_TRUE(Change(SessionAction::kRetract).has_value());
  PutAt(9, kFar_m);
  EXPECT_EQ(Change(SessionAction::kRestore)->state, SessionState::kQuarantined);
  ExpectSound();
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
  ASSERT_TRUE(Put(At(4, {200, 0}, "day")).has_value());
  ASSERT_TRUE(Put(At(6, {400, 0}, "day")).has_value());
  ASSERT_TRUE(Await<CompactionResult>([&](auto done) {
                store_->Compact({Dirty().revision, 5'000, {2}, "tester"}, std::move(done));
              }).has_value());
  ASSERT_TRUE(Put(At(8, {600, 0}, "day")).has_value());
  EXPECT_EQ(State(), SessionState::kLive);
  ASSERT_TRUE(Change(SessionAction::kRetract).has_value());
  EXPECT_EQ(Change(SessionAction::kRestore)->state, SessionState::kLive);
  EXPECT_TRUE(Put(At(7, {0, 0}, "day"))->judgement.has_value());
}

}  // namespace
}  // namespace atlas
