// A small keyframe in a tile of its own, on a grid of such.
#pragma once

#include "client/connection/requests.h"
#include "core/base/bytes.h"
#include "core/geometry/map_profile.h"
#include "core/keyframe/keyframe_codec.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas::testing {

inline Bytes WideBlob(const MapProfile& profile) {
  constexpr std::int32_t kRadius_cells = 8;
  return EncodeKeyframe(StreetKeyframe(profile, kRadius_cells, 1));
}

// In the middle of the tile of level 0 in that column and row.
inline KeyframeUpload WideUpload(
    const MapProfile& profile, const Bytes& blob, const KeyframeKey& key, int column, int row) {
  constexpr std::int64_t kTime_ms = 1'700'000'000'000;
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d((column + 0.5) * profile.tile_size_m(),
                                       (row + 0.5) * profile.tile_size_m(), 1.8);
  KeyframeUpload upload;
  upload.key = key;
  upload.time_ms = kTime_ms + 1'000 * std::int64_t{key.sequence};  // a tile a second
  upload.T_world_sensor = QuantizedPose::FromPose(pose);
  upload.blob = blob;
  return upload;
}

}  // namespace atlas::testing
