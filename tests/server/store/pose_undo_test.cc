// Batches of corrections that are undone: by another batch, all or nothing.
#include <random>
#include <set>

#include "tests/server/store/pose_batch_fixture.h"

namespace atlas {
namespace {

class PoseUndoTest : public PoseBatchTest {
 protected:
  // What is of now, but for revisions and numbers of batches: poses, states, tiles of keyframes.
  std::vector<std::string> RowsOfNow() {
    std::vector<std::string> rows;
    const auto ids = store_->ListKeyframeIds(0, 1'000).value();
    for (const std::int64_t id : ids) {
      const StoredKeyframe keyframe = store_->ReadKeyframe(id).value();
      std::string row = std::to_string(id) + " " + std::to_string(keyframe.record.pose.x_um) + " " +
                        std::string(SessionStateName(keyframe.record.session_state));
      for (const TileId& tile : keyframe.footprint) {
        row += " " + std::to_string(tile.x);
      }
      rows.push_back(std::move(row));
    }
    return rows;
  }
  StatusCode UndoCode(std::uint64_t batch) {
    const auto undone = Undo(batch);
    return undone ? StatusCode::kOk : undone.error().code();
  }
  std::set<TileId> Marked() {
    std::set<TileId> ids;
    for (const TileClaim& claim : Claim().claims) {
      ids.insert(claim.id);
      EXPECT_TRUE(Finish(claim, std::nullopt).has_value());
    }
    return ids;
  }
};

TEST_F(PoseUndoTest, EverythingIsAsItWasBeforeTheBatch) {
  Fill();
  const auto before = RowsOfNow();
  const auto map = Map();
  const auto batch = Apply({To(kDay, 1, 5), To(kDay, 3, 8), To(kNight, 2, 30)}, {kNight});
  ASSERT_TRUE(batch.has_value()) << batch.error().message();
  const auto after = RowsOfNow();
  ASSERT_NE(after, before);
  Marked();
  const auto undone = Undo(batch->batch);
  ASSERT_TRUE(undone.has_value()) << undone.error().message();
  EXPECT_EQ(undone->updated, 3U);
  EXPECT_EQ(undone->batch, batch->batch + 1);
  EXPECT_EQ(undone->revision, batch->revision + 1) << "one step";
  EXPECT_EQ(RowsOfNow(), before);
  EXPECT_EQ(Map(), map);
  EXPECT_EQ(StateOf(kNight), SessionState::kStaged);
  // What it leaves and where it comes: 5, 8; 1, 3; 11, 30, 13.
  EXPECT_EQ(Marked(),
            (std::set<TileId>{Tile(1), Tile(3), Tile(5), Tile(8), Tile(11), Tile(13), Tile(30)}));
  EXPECT_EQ(undone->tiles_marked, 7U);
  ExpectSound();
  const auto events = Events();
  ASSERT_EQ(events.size(), 4U);
  EXPECT_EQ(events[2],
            "poses_undone by alice of batch 2: batch 1: 3 poses, 7 tiles; staged again: bus/night");
  EXPECT_EQ(events[3], "session_staged by alice of bus/night: batch 2");
}

TEST_F(PoseUndoTest, UndoneTwiceItIsDoneAgain) {
  Fill();
  const auto batch = Apply({To(kDay, 1, 5), To(kNight, 2, 30)}, {kNight});
  const auto after = RowsOfNow();
  const auto undone = Undo(batch->batch);
  ASSERT_TRUE(undone.has_value());
  EXPECT_EQ(UndoCode(batch->batch), StatusCode::kConflict) << "it is undone already";
  const auto again = Undo(undone->batch);
  ASSERT_TRUE(again.has_value()) << again.error().message();
  EXPECT_EQ(RowsOfNow(), after);
  EXPECT_EQ(again->sessions.at(0).entered.state, SessionState::kLive);
  ASSERT_TRUE(Undo(again->batch).has_value());
  EXPECT_EQ(StateOf(kNight), SessionState::kStaged);
  ExpectSound();
}

TEST_F(PoseUndoTest, ABatchThatOnlyPublishedIsUndone) {
  Fill();
  const auto batch = Apply({}, {kNight});
  ASSERT_TRUE(batch.has_value());
  EXPECT_EQ(batch->updated, 0U);
  EXPECT_EQ(batch->batch, 1U);
  ASSERT_TRUE(Undo(1).has_value());
  EXPECT_EQ(StateOf(kNight), SessionState::kStaged);
  EXPECT_EQ(UndoCode(1), StatusCode::kConflict);
  ExpectSound();
}

TEST_F(PoseUndoTest, AQuarantinedOneIsStagedAgain) {
  Fill();
  PutAt(kNight, 4, 5'000, true);
  ASSERT_EQ(Apply({To(kNight, 4, 14)}, {kNight})->sessions.at(0).entered.state,
            SessionState::kQuarantined);
  const auto undone = Undo(1);
  ASSERT_TRUE(undone.has_value()) << undone.error().message();
  EXPECT_EQ(undone->tiles_marked, 0U);
  EXPECT_EQ(StateOf(kNight), SessionState::kStaged);
  ASSERT_TRUE(Undo(2).has_value());
  EXPECT_EQ(StateOf(kNight), SessionState::kQuarantined);
}

TEST_F(PoseUndoTest, AKeyframeThatWasCorrectedSinceIsAConflictThatNamesIt) {
  Fill();
  ASSERT_TRUE(Apply({To(kDay, 1, 5), To(kDay, 2, 6), To(kDay, 3, 7)}).has_value());
  ASSERT_TRUE(Apply({To(kDay, 3, 9), To(kDay, 2, 8)}).has_value());
  const auto before = RowsOfNow();
  const auto refused = Undo(1);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code(), StatusCode::kConflict);
  EXPECT_NE(refused.error().message().find("keyframe bus/day/2 was corrected since, by batch 2"),
            std::string::npos)
      << refused.error().message();
  EXPECT_EQ(RowsOfNow(), before);
  ASSERT_TRUE(Undo(2).has_value());
  EXPECT_EQ(UndoCode(1), StatusCode::kOk) << "all are where it put them";
}

TEST_F(PoseUndoTest, ASessionThatIsInAnotherStateSinceIsAConflict) {
  Fill();
  ASSERT_TRUE(Apply({To(kNight, 1, 20)}, {kNight}).has_value());
  ASSERT_TRUE(Change(SessionAction::kRetract, kNight).has_value());
  ASSERT_TRUE(Change(SessionAction::kRestore, kNight).has_value());
  const auto refused = Undo(1);
  EXPECT_EQ(refused.error().code(), StatusCode::kConflict);
  EXPECT_NE(refused.error().message().find("session bus/night became retracted since"),
            std::string::npos)
      << refused.error().message();
}

// Its own state did not change by the batch.
TEST_F(PoseUndoTest, ASessionThatWasTakenOutSinceGetsItsPosesBack) {
  Fill();
  ASSERT_TRUE(Apply({To(kDay, 1, 5)}).has_value());
  ASSERT_TRUE(Change(SessionAction::kRetract, kDay).has_value());
  const auto undone = Undo(1);
  ASSERT_TRUE(undone.has_value()) << undone.error().message();
  EXPECT_EQ(undone->tiles_marked, 0U);
  ASSERT_TRUE(Change(SessionAction::kRestore, kDay).has_value());
  EXPECT_EQ(Map().at("day1@1"), 1'000'000);
}

TEST_F(PoseUndoTest, WhatCameToAPublishedSessionSinceStaysInIt) {
  Fill();
  ASSERT_TRUE(Apply({To(kNight, 1, 20)}, {kNight}).has_value());
  PutAt(kNight, 4, 14, true);
  PutAt(kDay, 4, 4);
  ASSERT_TRUE(Undo(1).has_value());
  EXPECT_EQ(StateOf(kNight), SessionState::kStaged);
  EXPECT_EQ(store_->FindSession(kNight).value()->keyframes, 4U);
  EXPECT_EQ(Map().size(), 4U) << "those of the day";
  ASSERT_TRUE(Change(SessionAction::kPublish, kNight).has_value());
  EXPECT_EQ(Map().size(), 8U);
  ExpectSound();
}

TEST_F(PoseUndoTest, ABatchThatNeverWasIsNotFound) {
  Fill();
  EXPECT_EQ(UndoCode(0), StatusCode::kNotFound);
  EXPECT_EQ(UndoCode(1), StatusCode::kNotFound);
  EXPECT_EQ(UndoCode(0xffff'ffff'ffff'ffff), StatusCode::kNotFound);
}

TEST_F(PoseUndoTest, BehindTheHorizonIsNotFound) {
  Fill();
  ASSERT_TRUE(Apply({To(kDay, 1, 5)}).has_value());
  ASSERT_TRUE(Change(SessionAction::kPurge, kNight).has_value());
  const auto refused = Undo(1);
  EXPECT_EQ(refused.error().code(), StatusCode::kNotFound);
  EXPECT_NE(refused.error().message().find("no longer kept"), std::string::npos);
  ASSERT_TRUE(Apply({To(kDay, 1, 6)}).has_value());
  EXPECT_TRUE(Undo(2).has_value()) << "right behind it";
}

TEST_F(PoseUndoTest, BetweenReadingAndWritingNothingIsLost) {
  Fill();
  ASSERT_TRUE(Apply({To(kDay, 1, 5), To(kDay, 2, 6)}).has_value());
  PoseUndo undo{1, {To(kDay, 1, 1), To(kDay, 2, 2)}, "alice", kLimits};
  const auto write = [this](PoseUndo one) {
    const auto undone = Await<PoseBatchResult>(
        [&](auto done) { store_->UndoPoses(std::move(one), std::move(done)); });
    return undone ? StatusCode::kOk : undone.error().code();
  };
  EXPECT_EQ(write({1, {To(kDay, 1, 1)}, "alice"}), StatusCode::kInvalidData) << "not all of it";
  EXPECT_EQ(write({1, {To(kDay, 1, 1), To(kDay, 1, 1)}, "alice"}), StatusCode::kConflict);
  EXPECT_EQ(write({1, {To(kDay, 1, 1), To(kDay, 3, 3)}, "alice"}), StatusCode::kInvalidData);
  ASSERT_TRUE(Apply({To(kDay, 2, 9)}).has_value());
  EXPECT_EQ(write(undo), StatusCode::kConflict);
  EXPECT_EQ(Map().at("day1@5"), 5'000'000);
}

TEST_F(PoseUndoTest, DamageIsNamed) {
  Fill();
  ASSERT_TRUE(Apply({To(kDay, 1, 5)}).has_value());
  Tamper("UPDATE pose_history SET x_um = x_um + 1 WHERE batch = 0 AND keyframe_id = 1");
  Open();
  EXPECT_EQ(UndoCode(1), StatusCode::kInvalidData);
  Tamper("UPDATE pose_batches SET updated = 7");
  Open();
  EXPECT_EQ(UndoCode(1), StatusCode::kInvalidData);
}

// Random batches, undone one after the other: each time all is as it was before the batch.
TEST_F(PoseUndoTest, BatchesAreUndoneBackToTheBeginning) {
  for (std::uint32_t seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE(seed);
    store_.reset();
    std::filesystem::remove_all(options_.directory);
    Open();
    std::mt19937 random(seed);
    const auto pick = [&random](std::uint32_t count) {
      return static_cast<std::uint32_t>(random() % count);
    };
    std::vector<SessionKey> sessions;
    for (const char* const name : {"a", "b", "c", "d"}) {
      sessions.push_back({"bus", name});
      for (std::uint32_t i = 0; i < 5; ++i) {
        PutAt(sessions.back(), i, i, name[0] != 'a');
      }
    }
    std::vector<std::vector<std::string>> before;
    for (std::uint32_t batch = 1; batch <= 6; ++batch) {
      std::vector<NewPose> poses;
      for (const SessionKey& session : sessions) {
        for (std::uint32_t i = 0; i < 5; ++i) {
          if (pick(3) == 0) {
            poses.push_back(To(session, i, pick(60)));
          }
        }
      }
      before.push_back(RowsOfNow());
      const auto applied = Apply(std::move(poses), {sessions[pick(4)]});
      ASSERT_TRUE(applied.has_value()) << applied.error().message();
      if (applied->batch == 0) {
        before.pop_back();
      }
    }
    for (std::uint64_t batch = before.size(); batch > 0; --batch) {
      const auto undone = Undo(batch);
      ASSERT_TRUE(undone.has_value()) << undone.error().message();
      EXPECT_EQ(RowsOfNow(), before[batch - 1]) << "batch " << batch;
    }
    const auto ids = store_->ListKeyframeIds(0, 1'000).value();
    for (const std::int64_t id : ids) {
      EXPECT_TRUE(store_->ReadKeyframe(id).has_value());
    }
    EXPECT_TRUE(store_->CheckCounters().ok());
  }
}

}  // namespace
}  // namespace atlas
