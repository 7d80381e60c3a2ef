// Batches that publish, and batches that are undone: the tiles are those of an atlas that was told
// all of it otherwise, or never.
#include <string>
#include <vector>

#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

constexpr std::uint32_t kDrive = 6;

class PoseBatchesTest : public ServiceTest {
 protected:
  static UploadRequest Night(std::uint32_t i) {
    UploadRequest upload = DriveUpload(i + 2, "night");
    upload.is_staged = true;
    return upload;
  }
  void UploadBoth() {
    UploadDrive(kDrive);
    for (std::uint32_t i = 0; i < kDrive; ++i) {
      const auto put = Upload(Night(i));
      ASSERT_TRUE(put.has_value()) << put.error().message();
    }
  }
  // Of the night, and of the last half of the day.
  static std::vector<PoseBatchRequest::Update> Corrections(double dx_m = 0.0) {
    std::vector<PoseBatchRequest::Update> updates;
    for (std::uint32_t i = 0; i < kDrive; ++i) {
      updates.push_back({Night(i).key, PoseOf({1.5 * i - 2.0 + dx_m, 0.5, 1.9, 2.0 * i})});
      if (i >= kDrive / 2) {
        updates.push_back({DriveUpload(i).key, PoseOf({1.4 * i - 5.0 + dx_m, 0.1, 1.8, 3.0 * i})});
      }
    }
    return updates;
  }
  Result<PoseBatchResult> Apply(std::vector<PoseBatchRequest::Update> updates,
                                std::vector<SessionKey> published,
                                std::uint64_t if_revision = 0) {
    return Await<PoseBatchResult>([&](auto done) {
      service_->UpdatePoses({std::move(updates), "merge", if_revision, std::move(published)},
                            std::move(done));
    });
  }
  Result<PoseBatchResult> Undo(std::uint64_t batch, const std::string& author = "alice") {
    return Await<PoseBatchResult>([&](auto done) {
      service_->UndoPoses({batch, author}, std::move(done));
    });
  }
  const SessionKey night_{"bus", "night"};
};

TEST_F(PoseBatchesTest, PublishedByABatchItIsWhatItIsMovedAndPublished) {
  Open(2, "one");
  UploadBoth();
  const auto batch = Apply(Corrections(), {night_}, service_->revision());
  ASSERT_TRUE(batch.has_value()) << batch.error().message();
  EXPECT_EQ(batch->sessions.size(), 1U);
  const AtlasDigest one = Digest();
  Open(2, "two");
  UploadBoth();
  ASSERT_TRUE(Move(Corrections()).has_value());
  ASSERT_TRUE(Change("night", SessionAction::kPublish).has_value());
  EXPECT_EQ(Digest().sha256, one.sha256);
}

TEST_F(PoseBatchesTest, UndoneTheAtlasIsWhatItWas) {
  Open(2, "never");
  UploadBoth();
  const AtlasDigest never = Digest();
  Open();
  UploadBoth();
  EXPECT_EQ(Digest().sha256, never.sha256);
  const std::uint64_t before = service_->revision();
  const auto batch = Apply(Corrections(), {night_}, before);
  ASSERT_TRUE(batch.has_value()) << batch.error().message();
  const AtlasDigest merged = Digest();
  EXPECT_NE(merged.sha256, never.sha256);
  const auto undone = Undo(batch->batch);
  ASSERT_TRUE(undone.has_value()) << undone.error().message();
  EXPECT_EQ(Digest().sha256, never.sha256);
  EXPECT_EQ(DigestAt(before).sha256, never.sha256);
  EXPECT_EQ(DigestAt(batch->revision).sha256, merged.sha256) << "it was so for a while";
  ASSERT_TRUE(Undo(undone->batch).has_value());
  EXPECT_EQ(Digest().sha256, merged.sha256);
  Open(1);
  EXPECT_EQ(Digest().sha256, merged.sha256) << "after a restart";
  const auto report = service_->Verify({.rebuild = true}, Long());
  EXPECT_EQ(report->damaged + report->mismatched, 0U);
}

TEST_F(PoseBatchesTest, OneBatchAfterTheOtherIsUndone) {
  Open();
  UploadBoth();
  std::vector<AtlasDigest> digests = {Digest()};
  for (const double dx_m : {0.0, 0.7, 1.3}) {
    ASSERT_TRUE(Apply(Corrections(dx_m), {night_}).has_value());
    digests.push_back(Digest());
  }
  EXPECT_EQ(Undo(1).error().code(), StatusCode::kConflict);
  for (std::uint64_t batch = 3; batch > 0; --batch) {
    const auto undone = Undo(batch);
    ASSERT_TRUE(undone.has_value()) << undone.error().message();
    EXPECT_EQ(Digest().sha256, digests[batch - 1].sha256) << batch;
  }
}

// Found out before anything of it is looked for: what a purge took is no unknown keyframe.
TEST_F(PoseBatchesTest, WhatWasPurgedSinceIsAConflict) {
  Open();
  UploadBoth();
  const std::uint64_t computed_at = service_->revision();
  ASSERT_TRUE(Change("night", SessionAction::kPurge).has_value());
  const auto refused = Apply(Corrections(), {}, computed_at);
  EXPECT_EQ(refused.error().code(), StatusCode::kConflict) << refused.error().message();
  EXPECT_EQ(Apply(Corrections(), {}).error().code(), StatusCode::kNotFound);
}

TEST_F(PoseBatchesTest, NamesAndNumbersAreChecked) {
  Open();
  UploadBoth();
  EXPECT_EQ(Apply({}, {{"bus", "a b"}}).error().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(Apply({}, std::vector<SessionKey>(kMaxPublishedSessions + 1, night_)).error().code(),
            StatusCode::kInvalidArgument);
  ASSERT_TRUE(Apply(Corrections(), {}).has_value());
  EXPECT_EQ(Undo(1, "a b").error().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(Undo(2).error().code(), StatusCode::kNotFound);
}

TEST_F(PoseBatchesTest, AQuarantinedOneIsInTheLogOfTheDaemon) {
  Open();
  UploadBoth();
  UploadRequest far = DriveUpload(9, "night");
  far.pose = PoseOf({4'000.0, 0.0, 1.8, 0.0});
  ASSERT_TRUE(Upload(std::move(far)).has_value());
  const auto batch = Apply({}, {night_});
  ASSERT_TRUE(batch.has_value()) << batch.error().message();
  EXPECT_EQ(batch->sessions.at(0).entered.state, SessionState::kQuarantined);
  EXPECT_NE(Log().find("session bus/night is quarantined"), std::string::npos) << Log();
}

}  // namespace
}  // namespace atlas
