// What must hold before a keyframe or a pose is accepted: nothing behind this meets bad data.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "server/store/store_types.h"

namespace atlas {

struct UploadRequest {
  KeyframeKey key;
  std::int64_t time_ms = 0;
  QuantizedPose pose;
  std::optional<PositionPrior> prior;
  Bytes blob;
  bool is_staged = false;  // the session that it begins
};

// Keyframes may be this far ahead of the daemon's clock.
inline constexpr std::int64_t kMaxTimeAhead_ms = 60'000;

// The whole blob is decoded. kInvalidArgument on names, kInvalidData on everything else.
Result<NewKeyframe> CheckUpload(UploadRequest request,
                                const MapProfile& profile,
                                std::int64_t now_ms);

// A name, or empty.
Status CheckAuthor(const std::string& author);
// kInvalidArgument on names, and on a reason that is too long or holds control characters.
Status CheckSessionChange(const SessionChange& change);

// Placed with what is stored of its keyframe. kInvalidData names the keyframe whose pose is not one
// or is tilted against its levelling.
Result<NewPose> CheckPose(const KeyframeRecord& keyframe,
                          const QuantizedPose& pose,
                          const MapProfile& profile);

// The same of a keyframe that a compaction dropped: nothing is left to place it with.
Result<NewPose> CheckDroppedPose(const KeyframeKey& key, const QuantizedPose& pose);

}  // namespace atlas
