// Staged sessions: the atlas is the one without them, and published the one that they were uploaded
// to at once.
#include <random>
#include <string>
#include <vector>

#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

constexpr std::uint32_t kDrive = 6;

class StagedServiceTest : public ServiceTest {
 protected:
  static UploadRequest Night(std::uint32_t i, bool is_staged) {
    UploadRequest upload = DriveUpload(i + 2, "night");
    upload.is_staged = is_staged;
    return upload;
  }
  void UploadNight(bool is_staged, std::uint32_t begin = 0, std::uint32_t end = kDrive) {
    for (std::uint32_t i = begin; i < end; ++i) {
      const auto put = Upload(Night(i, is_staged));
      ASSERT_TRUE(put.has_value()) << put.error().message();
    }
  }
  static QuantizedPose Corrected(std::uint32_t i) {
    return PoseOf({1.5 * i - 2.0, 0.5, 1.9, 2.0 * i});
  }
  void MoveNight() {
    std::vector<PoseBatchRequest::Update> updates;
    for (std::uint32_t i = 0; i < kDrive; ++i) {
      updates.push_back({Night(i, true).key, Corrected(i)});
    }
    const auto moved = Move(std::move(updates));
    ASSERT_TRUE(moved.has_value()) << moved.error().message();
  }
  // Of an atlas of its own into which `fill` uploads.
  template <typename Fill>
  AtlasDigest DigestOf(const std::string& name, Fill fill) {
    Open(2, name);
    UploadDrive(kDrive);
    fill();
    return Digest();
  }
};

TEST_F(StagedServiceTest, TheAtlasIsAsIfItWereNotThere) {
  Open();
  UploadDrive(kDrive);
  const AtlasDigest day = Digest();
  UploadNight(true);
  EXPECT_EQ(service_->ReadStatus()->counts.keyframes, 2 * kDrive);
  EXPECT_EQ(Digest().sha256, day.sha256);
  MoveNight();
  EXPECT_EQ(Digest().sha256, day.sha256);
  Open(1);
  EXPECT_EQ(Digest().sha256, day.sha256) << "after a restart";
  const auto report = service_->Verify({.rebuild = true}, Long());
  EXPECT_EQ(report->damaged + report->mismatched, 0u);
}

TEST_F(StagedServiceTest, PublishedItIsWhatItWouldBeUploadedLive) {
  const AtlasDigest live = DigestOf("live", [this] { UploadNight(false); });
  const AtlasDigest published = DigestOf("staged", [this] {
    UploadNight(true);
    ASSERT_TRUE(Change("night", SessionAction::kPublish).has_value());
  });
  EXPECT_EQ(published.sha256, live.sha256);
  EXPECT_FALSE(Change("night", SessionAction::kPublish)->is_changed);
  EXPECT_EQ(Digest().revision, published.revision);
  EXPECT_EQ(Digest().sha256, live.sha256);
  EXPECT_NE(DigestAt(0).sha256, live.sha256);
}

TEST_F(StagedServiceTest, PosesOfAStagedSessionCountOnceItIsPublished) {
  const AtlasDigest live = DigestOf("live", [this] {
    UploadNight(false);
    MoveNight();
  });
  const AtlasDigest published = DigestOf("staged", [this] {
    UploadNight(true);
    MoveNight();
    ASSERT_TRUE(Change("night", SessionAction::kPublish).has_value());
  });
  EXPECT_EQ(published.sha256, live.sha256);
  const AtlasDigest moved_after = DigestOf("after", [this] {
    UploadNight(true);
    ASSERT_TRUE(Change("night", SessionAction::kPublish).has_value());
    MoveNight();
  });
  EXPECT_EQ(moved_after.sha256, live.sha256);
}

TEST_F(StagedServiceTest, PublishedInTheMiddleOfItsUploadOrTakenOutAndBack) {
  const AtlasDigest live = DigestOf("live", [this] { UploadNight(false); });
  for (std::uint32_t there = 1; there < kDrive; ++there) {
    SCOPED_TRACE(there);
    const AtlasDigest published = DigestOf("staged" + std::to_string(there), [&] {
      UploadNight(true, 0, there);
      ASSERT_TRUE(Change("night", SessionAction::kPublish).has_value());
      UploadNight(true, there);
    });
    EXPECT_EQ(published.sha256, live.sha256);
  }
  const AtlasDigest day = DigestOf("without", [] {});
  const AtlasDigest restored = DigestOf("restored", [this] {
    UploadNight(true);
    ASSERT_TRUE(Change("night", SessionAction::kRetract).has_value());
    ASSERT_TRUE(Change("night", SessionAction::kRestore).has_value());
  });
  EXPECT_EQ(restored.sha256, day.sha256);
}

// What a quota counts is on the disk.
TEST_F(StagedServiceTest, AQuotaCountsIt) {
  retention_.limits.vehicle_bytes = 3 * Night(0, true).blob.size();
  Open();
  StatusCode code = StatusCode::kOk;
  for (std::uint32_t i = 0; i < kDrive && code == StatusCode::kOk; ++i) {
    const auto put = Upload(Night(i, true));
    code = put ? StatusCode::kOk : put.error().code();
  }
  EXPECT_EQ(code, StatusCode::kResourceExhausted);
}

TEST_F(StagedServiceTest, SessionsArePublishedOneByOne) {
  Open();
  UploadNight(true);
  EXPECT_EQ(Change("", SessionAction::kPublish).error().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(Digest().tiles, 0u);
}

TEST_F(StagedServiceTest, ItsKeyframesAreListedWithTheirPosesOfNow) {
  Open();
  UploadNight(true);
  MoveNight();
  const auto page = service_->ListKeyframes({"bus", "night"}, std::nullopt, 100);
  ASSERT_TRUE(page.has_value()) << page.error().message();
  ASSERT_EQ(page->keyframes.size(), kDrive);
  for (std::uint32_t i = 0; i < kDrive; ++i) {
    EXPECT_EQ(page->keyframes[i].key.sequence, Night(i, true).key.sequence);
    EXPECT_EQ(page->keyframes[i].pose, Corrected(i));
  }
}

}  // namespace
}  // namespace atlas
