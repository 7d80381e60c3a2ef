// Batches of corrections that are applied only if nothing changed about their sessions, and such
// that publish.
#include "tests/server/store/pose_batch_fixture.h"

namespace atlas {
namespace {

class ConditionalBatchTest : public PoseBatchTest {
 protected:
  // A batch for `bus/day` that was computed at `revision` is refused, and says why.
  void ExpectConflict(std::uint64_t revision, const std::string& why) {
    const auto before = Map();
    const std::uint64_t current = store_->revision();
    const auto refused = Apply({To(kDay, 1, 5)}, {}, revision);
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code(), StatusCode::kConflict);
    EXPECT_NE(refused.error().message().find(why), std::string::npos) << refused.error().message();
    EXPECT_NE(refused.error().message().find("compute it again"), std::string::npos);
    EXPECT_EQ(Map(), before);
    EXPECT_EQ(store_->revision(), current);
  }
  std::uint64_t ChangedRevision(const SessionKey& key) {
    const auto page = store_->ListChangedSessions({}, 100).value();
    for (const SessionRecord& session : page.sessions) {
      if (session.key == key) {
        return session.changed_revision;
      }
    }
    return 0;
  }
};

TEST_F(ConditionalBatchTest, OtherSessionsMayChange) {
  Fill();
  const std::uint64_t computed_at = store_->revision();
  EXPECT_EQ(ChangedRevision(kDay), computed_at - 1);
  PutAt(kNight, 4, 14);
  PutAt({"tram", "day"}, 1, 30);
  ASSERT_TRUE(Apply({To(kNight, 1, 21)}).has_value());
  ASSERT_TRUE(Change(SessionAction::kPublish, kNight).has_value());
  EXPECT_EQ(ChangedRevision(kDay), computed_at - 1);
  const auto applied = Apply({To(kDay, 1, 5)}, {}, computed_at);
  ASSERT_TRUE(applied.has_value()) << applied.error().message();
  EXPECT_EQ(applied->updated, 1U);
  EXPECT_EQ(ChangedRevision(kDay), applied->revision);
  ExpectSound();
}

TEST_F(ConditionalBatchTest, AKeyframeThatCameIsAConflict) {
  Fill();
  const std::uint64_t computed_at = store_->revision();
  const std::uint64_t came_at = PutAt(kDay, 4, 4).revision;
  EXPECT_EQ(ChangedRevision(kDay), came_at);
  ExpectConflict(computed_at,
                 "session bus/day changed since revision " + std::to_string(computed_at) +
                     ": keyframe 4 was uploaded, at revision " + std::to_string(came_at));
  EXPECT_TRUE(Apply({To(kDay, 1, 5)}, {}, came_at).has_value());
}

TEST_F(ConditionalBatchTest, ACorrectedPoseIsAConflictAlsoOfAnotherKeyframe) {
  Fill();
  const std::uint64_t computed_at = store_->revision();
  const auto moved = Apply({To(kDay, 3, 7)});
  ExpectConflict(computed_at, "keyframe 3 was corrected by batch " + std::to_string(moved->batch));
  EXPECT_EQ(ChangedRevision(kDay), moved->revision);
}

// Whoever does not hear of its own batch, and sends it again.
TEST_F(ConditionalBatchTest, ItsOwnBatchIsAConflictThatNamesIt) {
  Fill();
  const std::uint64_t computed_at = store_->revision();
  const auto applied = Apply({To(kDay, 1, 5)}, {}, computed_at);
  ASSERT_TRUE(applied.has_value());
  ExpectConflict(computed_at,
                 "keyframe 1 was corrected by batch " + std::to_string(applied->batch));
}

TEST_F(ConditionalBatchTest, AnotherStateIsAConflict) {
  Fill();
  const std::uint64_t computed_at = store_->revision();
  const auto retracted = Change(SessionAction::kRetract, kDay);
  ExpectConflict(computed_at,
                 "it became retracted, at revision " + std::to_string(retracted->revision));
  EXPECT_EQ(ChangedRevision(kDay), retracted->revision);
  ASSERT_TRUE(Change(SessionAction::kRestore, kDay).has_value());
  ExpectConflict(computed_at, "it became retracted");
  ExpectConflict(retracted->revision, "it became live");
}

TEST_F(ConditionalBatchTest, TheFirstOneIsNamed) {
  Fill();
  const std::uint64_t computed_at = store_->revision();
  ASSERT_TRUE(Apply({To(kNight, 2, 25), To(kDay, 2, 9)}).has_value());
  const auto refused = Apply({To(kNight, 1, 20), To(kDay, 1, 8)}, {}, computed_at);
  EXPECT_NE(refused.error().message().find("session bus/day changed"), std::string::npos)
      << refused.error().message();
}

TEST_F(ConditionalBatchTest, WhatWasDroppedOrDeletedIsAConflict) {
  Fill();
  const std::uint64_t computed_at = store_->revision();
  const std::int64_t first = store_->ListKeyframeIds(0, 1).value().front();
  const auto compacted = Await<CompactionResult>([&](auto done) {
    store_->Compact({store_->revision(), 1'000, {first}, "tester"}, std::move(done));
  });
  ASSERT_TRUE(compacted.has_value()) << compacted.error().message();
  ExpectConflict(computed_at, "keyframes of it were dropped, at revision " +
                                  std::to_string(compacted->revision));
  EXPECT_EQ(ChangedRevision(kDay), compacted->revision);
  ASSERT_TRUE(Change(SessionAction::kPurge, kNight).has_value());
  ExpectConflict(compacted->revision, "is no longer known");
  const std::uint64_t purged_at = store_->revision();
  ASSERT_TRUE(Change(SessionAction::kPurge, kDay).has_value());
  const Status purged = store_->CheckUnchanged({kDay}, purged_at);
  EXPECT_EQ(purged.code(), StatusCode::kConflict);
  EXPECT_NE(purged.message().find("it became purged"), std::string::npos) << purged.message();
}

TEST_F(ConditionalBatchTest, ARevisionToComeIsNone) {
  Fill();
  const auto refused = Apply({To(kDay, 1, 5)}, {}, store_->revision() + 1);
  EXPECT_EQ(refused.error().code(), StatusCode::kInvalidArgument);
  EXPECT_TRUE(Apply({To(kDay, 1, 5)}, {}, store_->revision()).has_value());
  EXPECT_EQ(store_->CheckUnchanged({{"bus", "dusk"}}, 1).code(), StatusCode::kNotFound);
}

TEST_F(ConditionalBatchTest, TheConditionIsOnDisk) {
  Fill();
  const std::uint64_t computed_at = store_->revision();
  ASSERT_TRUE(Apply({To(kDay, 1, 5)}, {}, computed_at).has_value());
  ExpectSound();
  Open();
  ExpectSound();
}

TEST_F(ConditionalBatchTest, APublishedSessionIsWhereItWasMoved) {
  Fill();
  const std::uint64_t computed_at = store_->revision();
  const auto applied =
      Apply({To(kNight, 1, 21), To(kNight, 2, 22), To(kNight, 3, 23), To(kDay, 1, 5)}, {kNight},
            computed_at);
  ASSERT_TRUE(applied.has_value()) << applied.error().message();
  EXPECT_EQ(applied->updated, 4U);
  EXPECT_EQ(applied->revision, computed_at + 1) << "one step";
  EXPECT_EQ(applied->tiles_marked, 5U) << "where it is, not where it was staged";
  ASSERT_EQ(applied->sessions.size(), 1U);
  EXPECT_EQ(applied->sessions[0].key, kNight);
  EXPECT_EQ(applied->sessions[0].entered.state, SessionState::kLive);
  EXPECT_EQ(StateOf(kNight), SessionState::kLive);
  EXPECT_EQ(Map().at("night1@21"), 21'000'000);
  EXPECT_EQ(store_->GatherTileAt(Tile(21), computed_at)->keyframes.size(), 0U) << "not before";
  EXPECT_EQ(Events(), (std::vector<std::string>{
                          "poses by merge of batch 1: 4 poses, 5 tiles; published: bus/night",
                          "session_published by merge of bus/night: batch 1"}));
  ExpectSound();
}

TEST_F(ConditionalBatchTest, WhatLooksWrongAsItWasUploadedIsQuarantined) {
  Fill();
  PutAt(kNight, 4, 5'000, true);
  const auto applied = Apply({To(kNight, 4, 14)}, {kNight});
  ASSERT_TRUE(applied.has_value()) << applied.error().message();
  EXPECT_EQ(applied->updated, 1U) << "corrected all the same";
  EXPECT_EQ(applied->sessions.at(0).entered.state, SessionState::kQuarantined);
  EXPECT_EQ(applied->tiles_marked, 0U);
  EXPECT_EQ(StateOf(kNight), SessionState::kQuarantined);
  EXPECT_EQ(Events().at(0),
            "poses by merge of batch 1: 1 poses, 0 tiles; published: bus/night (quarantined)");
  EXPECT_NE(Events().at(2).find("session_quarantined by atlasd of bus/night"), std::string::npos);
  EXPECT_EQ(Apply({}, {kNight}).error().code(), StatusCode::kConflict) << "not staged any more";
  ExpectSound();
}

TEST_F(ConditionalBatchTest, OfOneInTheMapNothingChanges) {
  Fill();
  const std::uint64_t before = store_->revision();
  const auto nothing = Apply({}, {kDay});
  ASSERT_TRUE(nothing.has_value());
  EXPECT_EQ(nothing->batch, 0U);
  EXPECT_EQ(nothing->revision, before);
  EXPECT_TRUE(nothing->sessions.empty());
  ASSERT_TRUE(Change(SessionAction::kRelease, kDay).has_value());
  EXPECT_TRUE(Apply({To(kDay, 1, 5)}, {kDay}).has_value());
  EXPECT_EQ(StateOf(kDay), SessionState::kReleased);
}

TEST_F(ConditionalBatchTest, WhatCannotBePublishedKeepsTheBatchFromBeingApplied) {
  Fill();
  const auto before = Map();
  EXPECT_EQ(Apply({To(kDay, 1, 5)}, {{"bus", "dusk"}}).error().code(), StatusCode::kNotFound);
  EXPECT_EQ(Apply({To(kDay, 1, 5)}, {kNight, kNight}).error().code(), StatusCode::kInvalidData);
  ASSERT_TRUE(Change(SessionAction::kRetract, kNight).has_value());
  EXPECT_EQ(Apply({To(kDay, 1, 5)}, {kNight}).error().code(), StatusCode::kConflict);
  ASSERT_TRUE(Change(SessionAction::kPurge, kNight).has_value());
  EXPECT_EQ(Apply({To(kDay, 1, 5)}, {kNight}).error().code(), StatusCode::kConflict);
  EXPECT_EQ(Map(), before);
}

TEST_F(ConditionalBatchTest, ASessionThatIsToBePublishedMayNotHaveChangedEither) {
  Fill();
  const std::uint64_t computed_at = store_->revision();
  PutAt(kNight, 4, 14, true);
  const auto refused = Apply({To(kDay, 1, 5)}, {kNight}, computed_at);
  EXPECT_EQ(refused.error().code(), StatusCode::kConflict);
  EXPECT_EQ(StateOf(kNight), SessionState::kStaged);
}

TEST_F(ConditionalBatchTest, ManyThatArePublishedHaveALineEach) {
  Open();
  std::vector<SessionKey> sessions;
  for (int i = 0; i < 20; ++i) {
    sessions.push_back({"bus", std::string(60, 's') + std::to_string(10 + i)});
    PutAt(sessions.back(), 1, i, true);
  }
  ASSERT_TRUE(Apply({}, sessions).has_value());
  const auto events = store_->ListEvents(0, 100).value();
  ASSERT_EQ(events.size(), 21U);
  EXPECT_NE(events[0].detail.find("and 17 more"), std::string::npos) << events[0].detail;
  for (const Event& event : events) {
    EXPECT_LE(event.detail.size() + event.subject.size() + event.author.size(), 450U);
  }
}

TEST_F(ConditionalBatchTest, APageIsShorterWhereSessionsHaveManyKeyframes) {
  Fill();
  const auto first = store_->ListChangedSessions({}, 1).value();
  ASSERT_EQ(first.sessions.size(), 1U);
  EXPECT_TRUE(first.has_more);
  const auto rest = store_->ListChangedSessions(kDay, 1).value();
  ASSERT_EQ(rest.sessions.size(), 1U);
  EXPECT_FALSE(rest.has_more);
  EXPECT_EQ(rest.sessions[0].changed_revision, store_->revision());
}

}  // namespace
}  // namespace atlas
