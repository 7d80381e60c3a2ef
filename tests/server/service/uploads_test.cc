// What is accepted and what is refused before it can do harm.
#include <gmock/gmock.h>

#include "core/base/str_cat.h"
#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

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

TEST_F(UploadTest, TimesThatCannotBeAreNamed) {
  constexpr std::int64_t kYear2100_ms = 4'102'444'800'000;
  for (const std::int64_t time_ms : {INT64_MIN, std::int64_t{-1}, kYear2100_ms, INT64_MAX}) {
    UploadRequest request = DriveUpload(0);
    request.time_ms = time_ms;
    const auto put = Upload(std::move(request));
    ASSERT_FALSE(put.has_value()) << time_ms;
    EXPECT_EQ(put.error().code(), StatusCode::kInvalidData);
    EXPECT_THAT(put.error().message(), HasSubstr(StrCat("keyframe bus/day/0: time is ", time_ms)));
  }
}

// Farther than any map goes, each coordinate by itself.
TEST_F(UploadTest, PlacesOffTheWorldAreNamed) {
  const auto refusal = [this](std::int64_t QuantizedPose::*coordinate, std::int64_t um) {
    UploadRequest request = DriveUpload(0);
    request.pose.*coordinate = um;
    const auto put = Upload(std::move(request));
    EXPECT_EQ(put ? StatusCode::kOk : put.error().code(), StatusCode::kInvalidData) << um;
    return put ? std::string() : put.error().message();
  };
  for (const auto coordinate : {&QuantizedPose::x_um, &QuantizedPose::y_um, &QuantizedPose::z_um}) {
    for (const std::int64_t um : {INT64_MIN, -10'000'000'000'001, 10'000'000'000'001, INT64_MAX}) {
      EXPECT_THAT(refusal(coordinate, um), AllOf(HasSubstr("keyframe bus/day/0"), HasSubstr("km")));
    }
  }
}

// A continent away is a place like any other: it makes its own tiles, and none in between.
TEST_F(UploadTest, AContinentAwayIsOnTheMap) {
  Open(1);
  UploadDrive(1);
  const std::uint64_t tiles_here = [this] {
    Digest();
    return service_->ReadStatus()->counts.tiles;
  }();
  UploadRequest far = DriveUpload(1, "far");
  far.pose.x_um = 9'999'900'000'000;
  far.pose.y_um = -9'999'900'000'000;
  ASSERT_TRUE(Upload(std::move(far)).has_value());
  Digest();
  EXPECT_GT(service_->ReadStatus()->counts.tiles, tiles_here);
  EXPECT_LE(service_->ReadStatus()->counts.tiles, 3 * tiles_here);
  ASSERT_TRUE(Change("day", SessionAction::kRetract).has_value());
  ASSERT_TRUE(Change("far", SessionAction::kRetract).has_value());
  Digest();
  EXPECT_EQ(service_->ReadStatus()->counts.tiles, 0u);
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
