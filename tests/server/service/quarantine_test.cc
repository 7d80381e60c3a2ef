// Sessions that look wrong, and sessions that are deleted: the atlas is the one that never saw
// them.
#include <string>

#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

constexpr std::uint32_t kDrive = 5;

class QuarantineServiceTest : public ServiceTest {
 protected:
  static UploadRequest Wild(std::uint32_t i, const std::string& session) {
    UploadRequest upload = DriveUpload(i, session);
    upload.pose.x_um += 5'000 * std::int64_t{1'000'000};
    return upload;
  }
  // A drive of which one keyframe is somewhere else.
  void UploadWithWild(std::uint32_t wild, const std::string& session = "night") {
    for (std::uint32_t i = 0; i < kDrive; ++i) {
      const auto put = Upload(i == wild ? Wild(i, session) : DriveUpload(i, session));
      ASSERT_TRUE(put.has_value()) << put.error().message();
      EXPECT_FALSE(put->is_duplicate);
    }
  }
  SessionState State(const std::string& session = "night") {
    return service_->FindSession({"bus", session}).value()->state;
  }
  void ExpectVerified() {
    const auto report = service_->Verify({.rebuild = true}, Long());
    ASSERT_TRUE(report.has_value()) << report.error().message();
    EXPECT_EQ(report->damaged + report->mismatched, 0u)
        << (report->findings.empty() ? "" : report->findings.front());
  }
};

TEST_F(QuarantineServiceTest, OneWildKeyframeAmongRealOnesLeavesTheAtlasThatNeverSawThem) {
  Open(2, "reference");
  UploadDrive(kDrive);
  const AtlasDigest day = Digest();
  for (std::uint32_t wild = 0; wild < kDrive; ++wild) {
    SCOPED_TRACE(wild);
    Open(2, "wild" + std::to_string(wild));
    UploadDrive(kDrive);
    UploadWithWild(wild);
    EXPECT_EQ(State(), SessionState::kQuarantined);
    EXPECT_EQ(Digest().sha256, day.sha256);
    EXPECT_EQ(service_->ReadStatus()->counts.keyframes, 2 * kDrive);
    EXPECT_TRUE(Upload(Wild(wild, "night"))->is_duplicate);
  }
  ExpectVerified();
}

TEST_F(QuarantineServiceTest, FusedBeforeItWasFoundItLeavesAgain) {
  Open();
  UploadDrive(kDrive);
  const AtlasDigest day = Digest();
  ASSERT_TRUE(Upload(DriveUpload(2, "night")).has_value());
  const AtlasDigest both = Digest();
  EXPECT_NE(both.sha256, day.sha256);
  const auto found = Upload(Wild(3, "night"));
  ASSERT_TRUE(found->judgement.has_value());
  EXPECT_GT(found->tiles_marked, 0u);
  EXPECT_EQ(Digest().sha256, day.sha256);
  EXPECT_EQ(DigestAt(found->revision - 1).sha256, both.sha256) << "what it was before";
  EXPECT_EQ(DigestAt(found->revision).sha256, day.sha256);
}

TEST_F(QuarantineServiceTest, ReleasedIsWhatItWouldBeHadNobodyJudged) {
  Open();
  UploadWithWild(2);
  EXPECT_EQ(Digest().tiles, 0u);
  ASSERT_TRUE(Change("night", SessionAction::kRelease).has_value());
  const AtlasDigest released = Digest();
  plausibility_ = {0.0, 0.0, 0.0, 0.0};
  Open(1, "reference");
  UploadWithWild(2);
  EXPECT_EQ(State(), SessionState::kLive);
  EXPECT_EQ(released.sha256, Digest().sha256);
}

TEST_F(QuarantineServiceTest, TheLogSaysWhyAndWhatToDo) {
  Open();
  UploadWithWild(3);
  const std::string log = Log();
  EXPECT_NE(log.find("session bus/night is quarantined"), std::string::npos) << log;
  EXPECT_NE(log.find("keyframe 2 to 3: 5002 m in 0.10 s, at most 90 m/s and 50 m"),
            std::string::npos)
      << log;
}

TEST_F(QuarantineServiceTest, PurgedItIsTheAtlasThatNeverSawIt) {
  Open(2, "reference");
  UploadDrive(kDrive);
  const AtlasDigest day = Digest();
  Open();
  UploadDrive(kDrive);
  for (std::uint32_t i = 0; i < kDrive; ++i) {
    ASSERT_TRUE(Upload(DriveUpload(i + 2, "night")).has_value());
  }
  const AtlasDigest both = Digest();
  ASSERT_NE(both.sha256, day.sha256);
  const auto purged = Change("night", SessionAction::kPurge);
  ASSERT_TRUE(purged.has_value()) << purged.error().message();
  EXPECT_EQ(purged->keyframes, kDrive);
  EXPECT_EQ(Digest().sha256, day.sha256);
  EXPECT_EQ(Upload(DriveUpload(2, "night")).error().code(), StatusCode::kConflict);
  EXPECT_EQ(service_->DigestAt(both.revision, Long()).error().code(), StatusCode::kNotFound);
  EXPECT_EQ(DigestAt(purged->revision).sha256, day.sha256);
  Open();
  ASSERT_TRUE(Change("day", SessionAction::kRetract).has_value());
  ASSERT_TRUE(Change("day", SessionAction::kRestore).has_value());
  EXPECT_EQ(Digest().sha256, day.sha256);
  ExpectVerified();
}

TEST_F(QuarantineServiceTest, OnlySessionsAreReleasedAndPurged) {
  Open();
  UploadDrive(1);
  for (const auto action : {SessionAction::kRelease, SessionAction::kPurge}) {
    EXPECT_EQ(Change("", action).error().code(), StatusCode::kInvalidArgument);
    EXPECT_EQ(Change("dusk", action).error().code(), StatusCode::kNotFound);
  }
  EXPECT_EQ(State("day"), SessionState::kLive);
}

}  // namespace
}  // namespace atlas
