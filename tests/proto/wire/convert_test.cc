// Wire values to core's types and back, and the ones that must not come through.
#include "proto/wire/convert.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

TEST(ConvertTest, KeyRoundTrips) {
  const KeyframeKey key{{"bus-7", "2026.01_a"}, 4'000'000'000u};
  EXPECT_EQ(KeyFromWire(KeyToWire(key)).value(), key);
}

TEST(ConvertTest, RefusesANameThatIsNone) {
  wire::KeyframeKey message = KeyToWire({{"bus", "day"}, 1});
  message.set_vehicle("../etc");
  EXPECT_EQ(KeyFromWire(message).error().code(), StatusCode::kInvalidArgument);
}

TEST(ConvertTest, PoseRoundTrips) {
  Pose pose = Pose::Identity();
  pose.rotate(Eigen::AngleAxisd(-2.5, Eigen::Vector3d(0.1, -0.2, 1.0).normalized()));
  pose.translation() = Eigen::Vector3d(-1234.567891, 98765.4, -12.5);
  const QuantizedPose quantized = QuantizedPose::FromPose(pose);
  EXPECT_EQ(PoseFromWire(PoseToWire(quantized)).value(), quantized);
}

TEST(ConvertTest, RefusesAPoseThatIsNone) {
  EXPECT_EQ(PoseFromWire(wire::Pose()).error().code(), StatusCode::kInvalidData);
  wire::Pose far = PoseToWire(QuantizedPose());
  far.set_x_um(std::int64_t{1} << 62);
  EXPECT_EQ(PoseFromWire(far).error().code(), StatusCode::kInvalidData);
}

TEST(ConvertTest, ProfileRoundTrips) {
  MapProfile profile;
  profile.cell_size_um = 200'000;
  EXPECT_EQ(ProfileFromWire(ProfileToWire(profile)).value(), profile);
  EXPECT_FALSE(ProfileFromWire("").has_value());
}

TEST(ConvertTest, ErrorsSayWhetherToRetry) {
  const RemoteError conflict = ErrorFromWire(ErrorToWire({StatusCode::kConflict, "other bytes"}));
  EXPECT_EQ(conflict.status, Status(StatusCode::kConflict, "other bytes"));
  EXPECT_FALSE(conflict.retry);
  const RemoteError down = ErrorFromWire(ErrorToWire({StatusCode::kUnavailable, "draining"}));
  EXPECT_TRUE(down.retry);
  EXPECT_EQ(down.status.retry_after_ms(), 1'000);
}

TEST(ConvertTest, ErrorsSayHowLongToWait) {
  const auto sent_ms = [](const Status& status) {
    return ErrorToWire(status).retry_after_ms();
  };
  const Status busy(StatusCode::kUnavailable, "busy");
  EXPECT_EQ(sent_ms(busy), 1'000u) << "as usual";
  EXPECT_EQ(sent_ms({StatusCode::kResourceExhausted, "full"}), 5'000u);
  EXPECT_EQ(sent_ms(busy.WithRetryAfter(3'600'000).WithContext("bus")), 3'600'000u);
  EXPECT_EQ(sent_ms(busy.WithRetryAfter(std::int64_t{1} << 40)), ~0u) << "what fits";
  EXPECT_EQ(sent_ms(busy.WithRetryAfter(-1)), 0u);
  const Status conflict(StatusCode::kConflict, "other bytes");
  EXPECT_EQ(sent_ms(conflict.WithRetryAfter(7)), 0u) << "it does not pass";

  const Status hour = busy.WithRetryAfter(3'600'000);
  EXPECT_EQ(ErrorFromWire(ErrorToWire(hour)).status, hour);
  wire::Error silent = ErrorToWire(hour);
  silent.set_retry_after_ms(0);
  EXPECT_EQ(ErrorFromWire(silent).status, busy);
  wire::Error for_good = ErrorToWire(hour);
  for_good.set_retry(false);
  EXPECT_EQ(ErrorFromWire(for_good).status, busy);
}

TEST(ConvertTest, AReasonGoesWithItsError) {
  const Status full =
      Status(StatusCode::kResourceExhausted, "full").WithReason(StatusReason::kQuota);
  EXPECT_EQ(ErrorToWire(full.WithContext("upload")).reason(), "quota");
  const Status back = ErrorFromWire(ErrorToWire(full)).status;
  EXPECT_EQ(back.reason(), StatusReason::kQuota);
  EXPECT_EQ(back.message(), "full");
  EXPECT_EQ(ErrorToWire({StatusCode::kUnavailable, "draining"}).reason(), "");
  wire::Error later = ErrorToWire(full);
  later.set_reason("of a later version");
  EXPECT_EQ(ErrorFromWire(later).status.reason(), StatusReason::kNone);
}

TEST(ConvertTest, AnUnknownErrorCodeIsNeverOk) {
  wire::Error message;
  for (const int code : {0, -1, 11, 1000}) {
    message.set_code(code);
    EXPECT_EQ(ErrorFromWire(message).status.code(), StatusCode::kInternal) << code;
  }
}

}  // namespace
}  // namespace atlas
