// What was: sessions taken out and put back, and tiles' sources as of an earlier revision.
#include <algorithm>
#include <iterator>
#include <map>
#include <random>
#include <set>

#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

const TileId kA{0, 0, 0};
const TileId kB{0, 1, 0};
const TileId kC{0, -3, 5};

class HistoryTest : public StoreTest {
 protected:
  Result<SessionChangeResult> Change(SessionAction action, const std::string& session = "day") {
    return Await<SessionChangeResult>([&](auto done) {
      store_->ChangeSession({{"bus", session}, action, "tester", "why not"}, std::move(done));
    });
  }
  static NewPose Moved(std::uint32_t sequence, std::int64_t x_um, std::vector<TileId> footprint) {
    return {{{"bus", "day"}, sequence}, PoseAt(x_um), std::move(footprint)};
  }
  static NewKeyframe OfNight(std::uint32_t sequence, std::vector<TileId> footprint) {
    NewKeyframe keyframe = MakeKeyframe(sequence, std::move(footprint));
    keyframe.key.session.session = "night";
    return keyframe;
  }
  std::set<TileId> Marked() {
    std::set<TileId> ids;
    for (const TileClaim& claim : Claim().claims) {
      ids.insert(claim.id);
      EXPECT_TRUE(Finish(claim, std::nullopt).has_value());
    }
    return ids;
  }
  // x of each keyframe that makes the tile at a revision.
  std::vector<std::int64_t> XsAt(const TileId& id, std::uint64_t revision) {
    const auto sources = store_->GatherTileAt(id, revision);
    EXPECT_TRUE(sources.has_value()) << sources.error().message();
    std::vector<std::int64_t> xs;
    for (const KeyframeRecord& record : sources->keyframes) {
      xs.push_back(record.pose.x_um);
    }
    EXPECT_EQ(sources->revision, revision);
    return xs;
  }
  void TamperAndOpen(const std::string& sql) {
    Tamper(sql);
    Open();
  }
  std::vector<TileId> Footprints(std::uint8_t level) {
    return store_->ListFootprintTiles(level, -1, 1000).value();
  }
};

using Xs = std::vector<std::int64_t>;

TEST_F(HistoryTest, RetractingTakesASessionOutAndRestoringPutsItBack) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA, kB})).has_value());
  ASSERT_TRUE(Put(MakeKeyframe(2, {kB})).has_value());
  ASSERT_TRUE(Put(OfNight(1, {kC})).has_value());
  Marked();
  const auto retracted = Change(SessionAction::kRetract);
  ASSERT_TRUE(retracted.has_value()) << retracted.error().message();
  EXPECT_TRUE(retracted->is_changed);
  EXPECT_EQ(retracted->state, SessionState::kRetracted);
  EXPECT_EQ(retracted->tiles_marked, 2u);
  EXPECT_EQ(retracted->revision, 4u);
  EXPECT_EQ(Marked(), (std::set<TileId>{kA, kB}));
  EXPECT_TRUE(store_->GatherTile(kB, 0)->keyframes.empty());
  EXPECT_EQ(store_->ListSessions({}, 1'000)->at(0).state, SessionState::kRetracted);
  EXPECT_EQ(store_->ListSessions({}, 1'000)->at(1).state, SessionState::kLive);
  Open();
  const auto restored = Change(SessionAction::kRestore);
  ASSERT_TRUE(restored.has_value()) << restored.error().message();
  EXPECT_EQ(restored->state, SessionState::kLive);
  EXPECT_EQ(restored->revision, 5u);
  EXPECT_EQ(Marked(), (std::set<TileId>{kA, kB}));
  EXPECT_EQ(store_->GatherTile(kB, 0)->keyframes.size(), 2u);
}

// What someone knows of a tile who asks for what changed, now and then.
class Follower {
 public:
  explicit Follower(const TileId& tile) : tile_(tile) {}

  void CatchUp(AtlasStore& store) {
    const TileSources changed = store.GatherTile(tile_, revision_).value();
    if (changed.is_whole) {
      xs_.clear();
    }
    for (const std::int64_t id : changed.gone) {
      xs_.erase(id);
    }
    for (const KeyframeRecord& record : changed.keyframes) {
      xs_[record.id] = record.pose.x_um;
    }
    revision_ = changed.revision;
    const TileSources all = store.GatherTile(tile_, 0).value();
    std::map<std::int64_t, std::int64_t> expected;
    for (const KeyframeRecord& record : all.keyframes) {
      expected[record.id] = record.pose.x_um;
    }
    EXPECT_EQ(xs_, expected);
    EXPECT_EQ(store.GatherTile(tile_, revision_)->keyframes.size(), 0u);
  }

 private:
  TileId tile_;
  std::uint64_t revision_ = 0;
  std::map<std::int64_t, std::int64_t> xs_;  // by id
};

TEST_F(HistoryTest, WhoFollowsTheChangesOfATileKnowsAllOfIt) {
  Open();
  const std::vector<TileId> tiles{kA, kB, kC};
  std::vector<Follower> followers;
  for (int i = 0; i < 6; ++i) {
    followers.emplace_back(tiles[static_cast<std::size_t>(i) % 3]);
  }
  std::mt19937 random(7);
  const auto footprint = [&] {
    std::vector<TileId> some;
    std::copy_if(tiles.begin(), tiles.end(), std::back_inserter(some),
                 [&](const TileId&) { return random() % 2 == 0; });
    return some;
  };
  std::uint32_t keyframes = 0;
  for (int step = 0; step < 200; ++step) {
    const auto kind = random() % 9;
    if (kind <= 1 || keyframes == 0) {
      NewKeyframe keyframe = MakeKeyframe(keyframes++, footprint());
      ASSERT_TRUE(Put(std::move(keyframe)).has_value());
    } else if (kind == 8) {
      const auto ids = store_->ListKeyframeIds(0, 1000).value();
      std::vector<std::int64_t> dropped;
      std::copy_if(ids.begin(), ids.end(), std::back_inserter(dropped),
                   [&](std::int64_t) { return random() % 8 == 0; });
      ASSERT_TRUE(Await<CompactionResult>([&](auto done) {
                    store_->Compact({Dirty().revision, 0, dropped, "tester"}, std::move(done));
                  }).has_value());
    } else if (kind <= 4) {
      const auto x_um = static_cast<std::int64_t>(random() % 3);
      ASSERT_TRUE(
          Update({Moved(static_cast<std::uint32_t>(random() % keyframes), x_um, footprint())})
              .has_value());
    } else {
      ASSERT_TRUE(Change(random() % 2 == 0 ? SessionAction::kRetract : SessionAction::kRestore)
                      .has_value());
    }
    for (Follower& follower : followers) {
      if (random() % 3 == 0) {
        follower.CatchUp(*store_);
      }
    }
  }
}

TEST_F(HistoryTest, ASecondTimeChangesNothing) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  Marked();
  for (const SessionAction action : {SessionAction::kRestore, SessionAction::kRetract}) {
    Change(action).value();
    const DirtyState before = Dirty();
    const auto again = Change(action);
    ASSERT_TRUE(again.has_value());
    EXPECT_FALSE(again->is_changed);
    EXPECT_EQ(again->tiles_marked, 0u);
    EXPECT_EQ(again->revision, before.revision);
    EXPECT_EQ(Dirty().revision, before.revision);
  }
}

TEST_F(HistoryTest, AnUnknownSessionIsNotFound) {
  Open();
  const auto unknown = Change(SessionAction::kRetract);
  ASSERT_FALSE(unknown.has_value());
  EXPECT_EQ(unknown.error().code(), StatusCode::kNotFound);
  EXPECT_NE(unknown.error().message().find("bus/day"), std::string::npos);
  EXPECT_EQ(store_->ReadCounts()->revision, 0u);
}

TEST_F(HistoryTest, ARetractedSessionGrowsAndMovesWithoutMarks) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  Change(SessionAction::kRetract).value();
  Marked();
  const auto put = Put(MakeKeyframe(2, {kB}));
  ASSERT_TRUE(put.has_value());
  EXPECT_EQ(put->tiles_marked, 0u);
  EXPECT_TRUE(Put(MakeKeyframe(2, {kB}))->is_duplicate);
  const auto moved = Update({Moved(1, 9, {kC})});
  ASSERT_TRUE(moved.has_value());
  EXPECT_EQ(moved->updated, 1u);
  EXPECT_EQ(moved->tiles_marked, 0u);
  EXPECT_EQ(moved->batch, 1u);
  EXPECT_EQ(Dirty().dirty_tiles, 0u);
  EXPECT_EQ(store_->ListSessions({}, 1'000)->at(0).keyframes, 2u);
  EXPECT_EQ(store_->ListSessions({}, 1'000)->at(0).state, SessionState::kRetracted);
  Change(SessionAction::kRestore).value();
  EXPECT_EQ(Marked(), (std::set<TileId>{kB, kC}));
}

TEST_F(HistoryTest, SourcesAreThoseOfTheRevision) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());  // revision 1
  ASSERT_TRUE(Update({Moved(1, 5, {kB})}).has_value());
  ASSERT_TRUE(Put(MakeKeyframe(2, {kA})).has_value());
  ASSERT_TRUE(Update({Moved(1, 7, {kA}), Moved(2, 8, {kB})}).has_value());
  Change(SessionAction::kRetract).value();
  Change(SessionAction::kRestore).value();
  for (int reopened = 0; reopened < 2; ++reopened) {
    EXPECT_EQ(XsAt(kA, 0), Xs{});
    EXPECT_EQ(XsAt(kA, 1), Xs{0});
    EXPECT_EQ(XsAt(kB, 2), Xs{5});
    EXPECT_EQ(XsAt(kA, 3), (Xs{5, 0}));  // the first has left it, which fusion sees
    EXPECT_EQ(XsAt(kA, 4), (Xs{7, 8}));
    EXPECT_EQ(XsAt(kB, 5), Xs{});
    EXPECT_EQ(XsAt(kB, 6), (Xs{7, 8}));
    EXPECT_EQ(XsAt(kC, 6), Xs{});
    Open();
  }
}

TEST_F(HistoryTest, RevisionsToComeAndForgottenOnesAreRefused) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  EXPECT_TRUE(store_->CheckRevision(0).ok());
  EXPECT_TRUE(store_->CheckRevision(1).ok());
  EXPECT_EQ(store_->CheckRevision(2).code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(store_->CheckRevision(UINT64_MAX).code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(store_->GatherTileAt(kA, 2).error().code(), StatusCode::kInvalidArgument);
  ASSERT_TRUE(Await<CompactionResult>([&](auto done) {
                store_->Compact({1, 0, {1}, "tests"}, std::move(done));
              }).has_value());
  EXPECT_TRUE(store_->CheckRevision(2).ok());
  const Status forgotten = store_->CheckRevision(1);
  EXPECT_EQ(forgotten.code(), StatusCode::kNotFound);
  EXPECT_NE(forgotten.message().find("no longer kept, the oldest is 2"), std::string::npos);
  EXPECT_EQ(store_->GatherTileAt(kA, 1).error(), forgotten);
}

TEST_F(HistoryTest, FootprintsCoverWhatWasEverTouchedOnEveryLevel) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kC})).has_value());
  ASSERT_TRUE(Update({Moved(1, 5, {kA, kB, {0, 100, 100}})}).has_value());
  EXPECT_EQ(Footprints(0), (std::vector<TileId>{kC, kA, kB, {0, 100, 100}}));
  EXPECT_EQ(Footprints(1), (std::vector<TileId>{{1, -2, 2}, {1, 0, 0}, {1, 50, 50}}));
  EXPECT_EQ(Footprints(7), (std::vector<TileId>{{7, -1, 0}, {7, 0, 0}}));
  const auto second =
      store_->ListFootprintTiles(1, static_cast<std::int64_t>(TileId{1, -2, 2}.Key()), 1);
  EXPECT_EQ(second.value(), (std::vector<TileId>{{1, 0, 0}}));
  for (std::uint8_t level = 0; level < 8; ++level) {
    std::vector<TileId> all;
    ASSERT_TRUE(
        store_->ScanFootprintTiles({level}, [&](const TileId& id) { all.push_back(id); }).ok());
    EXPECT_EQ(all, Footprints(level));
  }
  std::vector<TileId> near;
  ASSERT_TRUE(
      store_->ScanFootprintTiles({1, -2, 0, 10, 3}, [&](const TileId& id) { near.push_back(id); })
          .ok());
  EXPECT_EQ(near, (std::vector<TileId>{{1, -2, 2}, {1, 0, 0}}));
}

TEST_F(HistoryTest, DamagedHistoryIsToldAndOnlyWhereItCounts) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  ASSERT_TRUE(Update({Moved(1, 5, {kA})}).has_value());
  EXPECT_TRUE(store_->ReadKeyframe(1).has_value());
  TamperAndOpen("UPDATE pose_history SET x_um = 1 WHERE revision = 1");
  EXPECT_EQ(store_->GatherTileAt(kA, 1).error().code(), StatusCode::kInvalidData);
  EXPECT_EQ(XsAt(kA, 2), Xs{5});
  EXPECT_EQ(store_->ReadKeyframe(1).error().code(), StatusCode::kInvalidData);
  EXPECT_TRUE(store_->GatherTile(kA, 0).has_value());
  EXPECT_TRUE(store_->CheckSession({"bus", "day"}).ok());
  TamperAndOpen("UPDATE session_states SET state = 3");
  EXPECT_EQ(store_->GatherTileAt(kA, 2).error().code(), StatusCode::kInvalidData);
  EXPECT_EQ(store_->CheckSession({"bus", "day"}).code(), StatusCode::kInvalidData);
  TamperAndOpen("DELETE FROM session_states; DELETE FROM pose_history WHERE revision = 2");
  EXPECT_EQ(store_->CheckSession({"bus", "day"}).code(), StatusCode::kInvalidData);
  EXPECT_EQ(store_->ReadKeyframe(1).error().code(), StatusCode::kInvalidData);
}

}  // namespace
}  // namespace atlas
