// Whether there is room for one more keyframe, by limits that may change at any time, and how often
// there was none. Thread-safe; what is stored is told by the store's writer.
#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "core/base/status.h"
#include "server/store/disk_room.h"
#include "server/store/upload_limits.h"
#include "server/store/write_figures.h"

namespace atlas {

// A keyframe that is not stored yet, and what is.
struct UploadSize {
  std::string vehicle;
  std::uint64_t blob_bytes = 0;
  // Looked at where there is a limit of them.
  std::uint64_t vehicle_bytes = 0;  // stored blobs of the vehicle
  std::uint64_t used_bytes = 0;     // pages of the database
};

class UploadRoom {
 public:
  using Clock = DiskRoom::Clock;

  // Without limits at first.
  explicit UploadRoom(DiskRoom::Read read_free_bytes) : disk_(std::move(read_free_bytes)) {}

  void set_limits(const UploadLimits& limits);
  UploadLimits limits() const;
  // kResourceExhausted, with one of kUploadRefusalReasons. What the system says
  // where it does not tell how much is free, and a floor is set.
  Status Check(const UploadSize& upload, Clock::time_point now);
  // Pages that are in use, when they change.
  void NoteUsed(std::uint64_t bytes);

  RoomFigures ReadFigures(Clock::time_point now);
  // Of any upload, by the floor or the store's limit.
  std::optional<WriteRefusal> last_refusal() const;

 private:
  Status CheckDisk(const UploadLimits& limits, Clock::time_point now);
  Status Refused(UploadRefusal why, Status status, Clock::time_point now);

  mutable std::mutex mutex_;
  UploadLimits limits_;
  std::uint64_t used_bytes_ = 0;
  std::array<std::uint64_t, kUploadRefusals> refused_{};
  std::optional<WriteRefusal> last_refusal_;
  DiskRoom disk_;
};

}  // namespace atlas
