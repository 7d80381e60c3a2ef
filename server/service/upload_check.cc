#include "server/service/upload_check.h"

#include <algorithm>
#include <utility>

#include "core/base/str_cat.h"
#include "core/fusion/observation/keyframe_placement.h"
#include "core/keyframe/keyframe_codec.h"

namespace atlas {
namespace {

constexpr std::size_t kMaxReasonBytes = 256;

Status CheckTime(std::int64_t time_ms, std::int64_t now_ms) {
  if (time_ms < 0 || time_ms > now_ms + kMaxTimeAhead_ms) {
    return Status(StatusCode::kInvalidData,
                  StrCat("time is ", time_ms, " ms, expected 0 to ", now_ms + kMaxTimeAhead_ms,
                         " (60 s ahead of the daemon's clock)"));
  }
  return {};
}

Result<KeyframeHeader> CheckBlob(ByteSpan blob, const MapProfile& profile) {
  auto header = ReadKeyframeHeader(blob);
  if (!header) {
    return header;
  }
  if (Status status = CheckKeyframeProfile(*header, profile); !status.ok()) {
    return Error(std::move(status));
  }
  return CheckKeyframe(blob);
}

Result<std::vector<TileId>> Footprint(const QuantizedPose& pose,
                                      const std::array<std::int32_t, 4>& level_quaternion,
                                      const GridGeometry& grid,
                                      const MapProfile& profile) {
  if (Status status = pose.Validate(); !status.ok()) {
    return Error(std::move(status));
  }
  const auto placement = PlaceKeyframe(pose, level_quaternion);
  if (!placement) {
    return Error(placement.error());
  }
  return FootprintTiles(*placement, grid, profile);
}

}  // namespace

Result<NewKeyframe> CheckUpload(UploadRequest request,
                                const MapProfile& profile,
                                std::int64_t now_ms) {
  const std::string name = StrCat("keyframe ", request.key);
  if (Status status = request.key.Validate(); !status.ok()) {
    return Error(std::move(status));
  }
  if (Status status = CheckTime(request.time_ms, now_ms); !status.ok()) {
    return Error(status.WithContext(name));
  }
  const auto header = CheckBlob(request.blob, profile);
  if (!header) {
    return Error(header.error().WithContext(name));
  }
  auto footprint = Footprint(request.pose, header->level_quaternion, header->grid, profile);
  if (!footprint) {
    return Error(footprint.error().WithContext(name));
  }
  NewKeyframe keyframe;
  keyframe.key = std::move(request.key);
  keyframe.time_ms = request.time_ms;
  keyframe.pose = request.pose;
  keyframe.grid = header->grid;
  keyframe.level_quaternion = header->level_quaternion;
  keyframe.prior = request.prior;
  keyframe.blob = std::move(request.blob);
  keyframe.is_staged = request.is_staged;
  keyframe.footprint = std::move(*footprint);
  return keyframe;
}

Status CheckAuthor(const std::string& author) {
  return author.empty() ? Status() : ValidateName("author", author);
}

Status CheckSessionChange(const SessionChange& change) {
  ATLAS_RETURN_IF_ERROR(change.key.session.empty() ? ValidateName("vehicle", change.key.vehicle)
                                                   : change.key.Validate());
  ATLAS_RETURN_IF_ERROR(CheckAuthor(change.author));
  const bool is_of_all =
      change.action == SessionAction::kRetract || change.action == SessionAction::kRestore;
  if (!is_of_all && change.key.session.empty()) {
    return Status(
        StatusCode::kInvalidArgument,
        StrCat("vehicle ", change.key.vehicle,
               ": sessions are released, published and purged one by one; name the session"));
  }
  const bool is_line = std::none_of(change.reason.begin(), change.reason.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
  });
  return is_line && change.reason.size() <= kMaxReasonBytes
             ? Status()
             : Status(StatusCode::kInvalidArgument,
                      StrCat("session ", change.key, ": expected a reason of one line of at most ",
                             kMaxReasonBytes, " bytes"));
}

Result<NewPose> CheckPose(const KeyframeRecord& keyframe,
                          const QuantizedPose& pose,
                          const MapProfile& profile) {
  auto footprint = Footprint(pose, keyframe.level_quaternion, keyframe.grid, profile);
  if (!footprint) {
    return Error(footprint.error().WithContext(StrCat("keyframe ", keyframe.key)));
  }
  return NewPose{keyframe.key, pose, std::move(*footprint)};
}

Result<NewPose> CheckDroppedPose(const KeyframeKey& key, const QuantizedPose& pose) {
  if (Status status = pose.Validate(); !status.ok()) {
    return Error(status.WithContext(StrCat("keyframe ", key)));
  }
  return NewPose{key, pose, {}};
}

}  // namespace atlas
