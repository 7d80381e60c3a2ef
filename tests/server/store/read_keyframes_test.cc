// Keyframes read back as they were uploaded, from a store and from its file.
#include "server/store/sqlite/store_snapshot.h"
#include "tests/server/store/pose_batch_fixture.h"

namespace atlas {
namespace {

class ReadKeyframesTest : public PoseBatchTest {
 protected:
  static NewKeyframe WithPrior(std::uint32_t sequence) {
    NewKeyframe keyframe = MakeKeyframe(sequence, {Tile(1)});
    keyframe.blob.assign(1'000 + sequence, static_cast<std::uint8_t>(sequence + 1));
    if (sequence % 2 == 0) {
      keyframe.prior = PositionPrior{-5, 1'000'000'000'000, 7, 2'500};
    }
    return keyframe;
  }
  static std::size_t CostOf(std::uint32_t sequence) {
    return kKeyframeBesidesBlobBytes + 1'000 + sequence;
  }
  void FillWithPriors() {
    Open();
    for (const std::uint32_t sequence : {0U, 2U, 3U, 9U}) {
      ASSERT_TRUE(Put(WithPrior(sequence)).has_value());
    }
    ASSERT_TRUE(Update({{{kDay, 3}, PoseAt(70'000'000), {Tile(2)}}}).has_value());
  }
  static std::vector<std::uint32_t> SequencesOf(const KeyframeContents& contents) {
    std::vector<std::uint32_t> sequences;
    for (const KeyframeContent& content : contents.keyframes) {
      sequences.push_back(content.sequence);
    }
    return sequences;
  }
  static void ExpectAll(const KeyframeContents& all) {
    ASSERT_EQ(SequencesOf(all), (std::vector<std::uint32_t>{0, 2, 3, 9}));
    EXPECT_EQ(all.next_bytes, std::nullopt);
    for (const KeyframeContent& content : all.keyframes) {
      const NewKeyframe uploaded = WithPrior(content.sequence);
      EXPECT_TRUE(content.damage.ok()) << content.damage.message();
      EXPECT_EQ(content.blob, uploaded.blob);
      EXPECT_EQ(content.time_ms, uploaded.time_ms);
      EXPECT_EQ(content.pose.x_um, content.sequence == 3 ? 70'000'000 : 0) << "as it is now";
      ASSERT_EQ(content.prior.has_value(), uploaded.prior.has_value());
      if (content.prior) {
        EXPECT_EQ(content.prior->x_um, -5);
        EXPECT_EQ(content.prior->y_um, 1'000'000'000'000);
        EXPECT_EQ(content.prior->z_um, 7);
        EXPECT_EQ(content.prior->radius_mm, 2'500U);
      }
    }
  }
};

TEST_F(ReadKeyframesTest, TheyAreAsTheyWereUploadedWhereTheyAreNow) {
  FillWithPriors();
  ExpectAll(store_->ReadKeyframes(kDay, std::nullopt, 1'000'000).value());
  Open();
  ExpectAll(store_->ReadKeyframes(kDay, std::nullopt, 1'000'000).value());
}

TEST_F(ReadKeyframesTest, AFileTellsTheSame) {
  FillWithPriors();
  auto snapshot = StoreSnapshot::Open(Database());
  ASSERT_TRUE(snapshot.has_value()) << snapshot.error().message();
  ExpectAll(snapshot->ReadKeyframes(kDay, std::nullopt, 1'000'000).value());
  ASSERT_TRUE(Update({{{kDay, 9}, PoseAt(80'000'000), {Tile(2)}}}).has_value());
  ASSERT_TRUE(Put(WithPrior(11)).has_value());
  ExpectAll(snapshot->ReadKeyframes(kDay, std::nullopt, 1'000'000).value());
  const auto sessions = snapshot->ListSessions({}, 10).value();
  ASSERT_EQ(sessions.sessions.size(), 1U);
  EXPECT_EQ(sessions.sessions[0].changed_revision, 5U) << "of its state";
  EXPECT_EQ(snapshot->ReadKeyframes(kNight, std::nullopt, 1).error().code(), StatusCode::kNotFound);
}

TEST_F(ReadKeyframesTest, AsManyComeAsThereIsRoomFor) {
  FillWithPriors();
  const std::size_t two = CostOf(0) + CostOf(2);
  const auto first = store_->ReadKeyframes(kDay, std::nullopt, two).value();
  EXPECT_EQ(SequencesOf(first), (std::vector<std::uint32_t>{0, 2}));
  EXPECT_EQ(first.next_bytes, CostOf(3));
  const auto one = store_->ReadKeyframes(kDay, std::nullopt, two - 1).value();
  EXPECT_EQ(SequencesOf(one), (std::vector<std::uint32_t>{0}));
  EXPECT_EQ(one.next_bytes, CostOf(2));
  const auto none = store_->ReadKeyframes(kDay, 2, 0).value();
  EXPECT_TRUE(none.keyframes.empty());
  EXPECT_EQ(none.next_bytes, CostOf(3));
  const auto rest = store_->ReadKeyframes(kDay, 2, 1'000'000).value();
  EXPECT_EQ(SequencesOf(rest), (std::vector<std::uint32_t>{3, 9}));
  EXPECT_EQ(SequencesOf(store_->ReadKeyframes(kDay, 4, 1'000'000).value()),
            (std::vector<std::uint32_t>{9}));
  EXPECT_TRUE(store_->ReadKeyframes(kDay, 0xffffffff, 1'000'000)->keyframes.empty());
  EXPECT_EQ(store_->ReadKeyframes(kNight, std::nullopt, 1).error().code(), StatusCode::kNotFound);
}

TEST_F(ReadKeyframesTest, MoreThanAreLookedForAtATime) {
  Open();
  for (std::uint32_t sequence = 1; sequence <= 150; ++sequence) {
    PutAt(kDay, sequence, 1);
  }
  EXPECT_EQ(store_->ReadKeyframes(kDay, std::nullopt, 1'000'000)->keyframes.size(), 150U);
  EXPECT_EQ(store_->ReadKeyframes(kDay, 86, 1'000'000)->keyframes.size(), 64U);
}

TEST_F(ReadKeyframesTest, DamagedOnesAreToldAndTheOthersCome) {
  FillWithPriors();
  Tamper(
      "UPDATE keyframes SET blob = zeroblob(1000) WHERE sequence = 0; "
      "UPDATE keyframes SET time_ms = time_ms + 1 WHERE sequence = 2; "
      "UPDATE poses SET x_um = x_um + 1 WHERE keyframe_id = 3");
  Open();
  const auto contents = store_->ReadKeyframes(kDay, std::nullopt, 1'000'000).value();
  ASSERT_EQ(SequencesOf(contents), (std::vector<std::uint32_t>{0, 2, 3, 9}));
  const std::vector<std::string> why = {"the blob of keyframe 1", "the row of keyframe 2",
                                        "the pose of keyframe 3"};
  for (std::size_t i = 0; i < why.size(); ++i) {
    const KeyframeContent& content = contents.keyframes[i];
    EXPECT_EQ(content.damage.code(), StatusCode::kInvalidData);
    EXPECT_NE(content.damage.message().find(why[i]), std::string::npos) << content.damage.message();
    EXPECT_TRUE(content.blob.empty());
  }
  EXPECT_TRUE(contents.keyframes[3].damage.ok());
  EXPECT_EQ(contents.keyframes[3].blob, WithPrior(9).blob);
  Tamper("UPDATE sessions SET bytes = 1");
  auto snapshot = StoreSnapshot::Open(Database());
  EXPECT_EQ(snapshot->ReadKeyframes(kDay, std::nullopt, 1'000'000).error().code(),
            StatusCode::kInvalidData);
}

TEST_F(ReadKeyframesTest, WhatACompactionDroppedOrAPurgeDeletedDoesNotCome) {
  FillWithPriors();
  const auto compacted = Await<CompactionResult>([&](auto done) {
    store_->Compact({store_->revision(), 5'000, {1, 2}, "tester"}, std::move(done));
  });
  ASSERT_TRUE(compacted.has_value()) << compacted.error().message();
  EXPECT_EQ(SequencesOf(store_->ReadKeyframes(kDay, std::nullopt, 1'000'000).value()),
            (std::vector<std::uint32_t>{3, 9}));
  ASSERT_TRUE(Change(SessionAction::kPurge, kDay).has_value());
  EXPECT_TRUE(store_->ReadKeyframes(kDay, std::nullopt, 1'000'000)->keyframes.empty());
}

}  // namespace
}  // namespace atlas
