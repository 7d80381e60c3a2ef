#include "server/store/upload_room.h"

#include <utility>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr const char* kWaysToMakeRoom =
    "purge sessions (atlas session purge), compact the atlas (preset bounded)";

Status NoRoom(UploadRefusal why, std::string message) {
  const auto i = static_cast<std::size_t>(why);
  return Status(StatusCode::kResourceExhausted, std::move(message))
      .WithReason(kUploadRefusalReasons[i])
      .WithRetryAfter(kUploadRefusalWaits_ms[i]);
}

// `more_bytes` behind those in use.
Status CheckStore(const UploadLimits& limits, std::uint64_t used_bytes, std::uint64_t more_bytes) {
  if (limits.store_bytes == 0 || used_bytes + more_bytes <= limits.store_bytes) {
    return {};
  }
  return NoRoom(
      UploadRefusal::kStoreLimit,
      StrCat("the atlas takes ", used_bytes, " bytes, of ", limits.store_bytes,
             " that it may (retention.store_mib): ", kWaysToMakeRoom, ", or raise the limit"));
}

Status CheckVehicle(const UploadLimits& limits, const UploadSize& upload) {
  if (limits.vehicle_bytes == 0 ||
      upload.vehicle_bytes + upload.blob_bytes <= limits.vehicle_bytes) {
    return {};
  }
  return NoRoom(
      UploadRefusal::kQuota,
      StrCat("vehicle ", upload.vehicle, ": ", upload.vehicle_bytes,
             " bytes of its keyframes are stored, of ", limits.vehicle_bytes,
             " that may be (retention.vehicle_mib): ", kWaysToMakeRoom, ", or raise the quota"));
}

}  // namespace

UploadLimits UploadRoom::limits() const {
  const std::lock_guard lock(mutex_);
  return limits_;
}

void UploadRoom::set_limits(const UploadLimits& limits) {
  const std::lock_guard lock(mutex_);
  limits_ = limits;
}

void UploadRoom::NoteUsed(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  used_bytes_ = bytes;
}

std::optional<WriteRefusal> UploadRoom::last_refusal() const {
  const std::lock_guard lock(mutex_);
  return last_refusal_;
}

Status UploadRoom::CheckDisk(const UploadLimits& limits, Clock::time_point now) {
  if (limits.disk_floor_bytes == 0) {
    return {};
  }
  const Result<std::uint64_t> free_bytes = disk_.FreeBytes(now);
  if (!free_bytes) {
    return free_bytes.error();
  }
  if (*free_bytes >= limits.disk_floor_bytes) {
    return {};
  }
  return NoRoom(
      UploadRefusal::kDiskFloor,
      StrCat(*free_bytes, " bytes are free on the atlas's disk, of ", limits.disk_floor_bytes,
             " that stay free (retention.disk_floor_mib): make room on it"));
}

Status UploadRoom::Refused(UploadRefusal why, Status status, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  ++refused_[static_cast<std::size_t>(why)];
  if (why != UploadRefusal::kQuota) {
    last_refusal_ = {status, now};
  }
  return status;
}

Status UploadRoom::Check(const UploadSize& upload, Clock::time_point now) {
  const UploadLimits limits = this->limits();
  if (Status status = CheckDisk(limits, now); !status.ok()) {
    return status.reason() == StatusReason::kNone
               ? status
               : Refused(UploadRefusal::kDiskFloor, std::move(status), now);
  }
  if (Status status = CheckStore(limits, upload.used_bytes, upload.blob_bytes); !status.ok()) {
    return Refused(UploadRefusal::kStoreLimit, std::move(status), now);
  }
  if (Status status = CheckVehicle(limits, upload); !status.ok()) {
    return Refused(UploadRefusal::kQuota, std::move(status), now);
  }
  return {};
}

RoomFigures UploadRoom::ReadFigures(Clock::time_point now) {
  RoomFigures figures;
  {
    const std::lock_guard lock(mutex_);
    figures.limits = limits_;
    figures.used_bytes = used_bytes_;
    figures.refused = refused_;
  }
  if (const auto free_bytes = disk_.FreeBytes(now)) {
    figures.free_disk_bytes = *free_bytes;
  }
  figures.refusing = CheckDisk(figures.limits, now);
  if (figures.refusing.ok()) {
    figures.refusing = CheckStore(figures.limits, figures.used_bytes, 1);
  }
  return figures;
}

}  // namespace atlas
