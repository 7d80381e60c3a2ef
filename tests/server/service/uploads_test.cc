// What is accepted and what is refused before it can do harm.
#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

class UploadTest : public ServiceTest {
 protected:
  void SetUp() override { Open(0); }

  StatusCode UploadCode(UploadRequest request) {
    const auto result = Upload(std::move(request));
    return result ? StatusCode::kOk : result.error().code();
  }
};

TEST_F(UploadTest, AcceptsAndAnswersAResend) {
  EXPECT_FALSE(Upload(DriveUpload(0))->is_duplicate);
  EXPECT_TRUE(Upload(DriveUpload(0))->is_duplicate);
  UploadRequest other = DriveUpload(0);
  other.blob = DriveUpload(1).blob;
  EXPECT_EQ(UploadCode(std::move(other)), StatusCode::kConflict);
}

TEST_F(UploadTest, RefusesNamesTimesAndPosesThatAreNone) {
  UploadRequest request = DriveUpload(0);
  request.key.session.vehicle = "a b";
  EXPECT_EQ(UploadCode(request), StatusCode::kInvalidArgument);
  request = DriveUpload(0);
  request.time_ms = -1;
  EXPECT_EQ(UploadCode(request), StatusCode::kInvalidData);
  request.time_ms = kTestNow_ms + kMaxTimeAhead_ms + 1;
  EXPECT_EQ(UploadCode(request), StatusCode::kInvalidData);
  request.time_ms = kTestNow_ms + kMaxTimeAhead_ms;
  EXPECT_EQ(UploadCode(request), StatusCode::kOk);
  request = DriveUpload(1);
  request.pose.quaternion = {0, 0, 0, 0};
  EXPECT_EQ(UploadCode(request), StatusCode::kInvalidData);
  request = DriveUpload(1);
  request.pose.x_um = INT64_MAX;
  EXPECT_EQ(UploadCode(request), StatusCode::kInvalidData);
  EXPECT_EQ(service_->ReadStatus()->counts.keyframes, 1u);
}

TEST_F(UploadTest, RefusesDamagedAndForeignBlobs) {
  const Bytes blob = DriveUpload(0).blob;
  for (std::size_t i = 0; i < blob.size(); i += 1 + blob.size() / 97) {
    UploadRequest request = DriveUpload(0);
    request.blob[i] ^= 0x40;
    EXPECT_NE(UploadCode(std::move(request)), StatusCode::kOk) << "byte " << i;
  }
  UploadRequest empty = DriveUpload(0);
  empty.blob.clear();
  EXPECT_EQ(UploadCode(std::move(empty)), StatusCode::kInvalidData);
  MapProfile other = TestProfile();
  other.segment_height_mm = 500;
  UploadRequest foreign = DriveUpload(0);
  foreign.blob = EncodeKeyframe(testing::StreetKeyframe(other, 24, 1));
  EXPECT_EQ(UploadCode(std::move(foreign)), StatusCode::kInvalidData);
  EXPECT_EQ(service_->ReadStatus()->counts.revision, 0u);
}

TEST_F(UploadTest, ATiltedCorrectionAsksForANewUpload) {
  ASSERT_EQ(UploadCode(DriveUpload(0)), StatusCode::kOk);
  Pose tilted = Pose::Identity();
  tilted.rotate(Eigen::AngleAxisd(0.06, Eigen::Vector3d::UnitX()));  // 3.4 degrees
  const auto moved = Move({{DriveUpload(0).key, QuantizedPose::FromPose(tilted)}});
  ASSERT_FALSE(moved.has_value());
  EXPECT_EQ(moved.error().code(), StatusCode::kInvalidData);
  EXPECT_NE(moved.error().message().find("upload"), std::string::npos);
  EXPECT_NE(moved.error().message().find("bus/day/0"), std::string::npos);
}

TEST_F(UploadTest, AnUnknownKeyframeIsNotFound) {
  ASSERT_EQ(UploadCode(DriveUpload(0)), StatusCode::kOk);
  const auto moved = Move(
      {{DriveUpload(0).key, PoseOf({1, 1, 1, 1})}, {DriveUpload(7).key, PoseOf({1, 1, 1, 1})}});
  EXPECT_EQ(moved.error().code(), StatusCode::kNotFound);
  EXPECT_EQ(service_->ReadStatus()->counts.revision, 1u);
}

}  // namespace
}  // namespace atlas
