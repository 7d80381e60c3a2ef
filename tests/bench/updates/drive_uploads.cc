#include "tests/bench/updates/drive_uploads.h"

#include <algorithm>
#include <utility>

#include "core/base/str_cat.h"
#include "core/keyframe/keyframe_codec.h"
#include "tests/bench/accuracy/drive_map.h"

namespace atlas::testing {
namespace {

constexpr double kSessionJump_m = 10.0;  // as ingest

}  // namespace

Result<std::vector<UploadRequest>> MakeUploads(const SimulatedDrive& drive,
                                               const MapProfile& profile,
                                               const UploadOptions& options) {
  const std::size_t end = std::min(options.end, drive.scans());
  const auto builder = FindBuilder(drive, options.begin, end, profile, options.range_m);
  if (!builder) return Error(builder.error());
  std::vector<UploadRequest> uploads;
  int leg = 1;
  for (std::size_t i = options.begin; i < end; ++i) {
    const Pose& pose = drive.sensor_pose(i);
    if (i > options.begin &&
        (pose.translation() - drive.sensor_pose(i - 1).translation()).norm() > kSessionJump_m) {
      ++leg;
    }
    UploadRequest upload;
    const std::string session = leg == 1 ? options.session : StrCat(options.session, ".", leg);
    upload.key = {{options.vehicle, session}, static_cast<std::uint32_t>(i)};
    upload.time_ms = options.start_ms + static_cast<std::int64_t>(drive.time_s(i) * 1e3);
    upload.pose = QuantizedPose::FromPose(pose);
    upload.blob = EncodeKeyframe(BuildKeyframe(*builder, drive, i));
    uploads.push_back(std::move(upload));
  }
  return uploads;
}

}  // namespace atlas::testing
