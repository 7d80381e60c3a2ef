// How much room uploads may take, and why one was refused for it: plain values.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/base/status.h"

namespace atlas {

// 0: no limit.
struct UploadLimits {
  std::uint64_t store_bytes = 0;       // pages of the database that are in use
  std::uint64_t vehicle_bytes = 0;     // blobs of the stored keyframes of one vehicle
  std::uint64_t disk_floor_bytes = 0;  // that stay free on the atlas's file system

  friend bool operator==(const UploadLimits&, const UploadLimits&) = default;
};

// In the order in which they are looked at.
enum class UploadRefusal : std::uint8_t { kDiskFloor = 0, kStoreLimit = 1, kQuota = 2 };
inline constexpr std::size_t kUploadRefusals = 3;

inline constexpr std::array<StatusReason, kUploadRefusals> kUploadRefusalReasons = {
    StatusReason::kDiskFloor, StatusReason::kStoreLimit, StatusReason::kQuota};

// After which whoever was refused may ask again. A disk is made room on in seconds; the others take
// a compaction, a purge or another limit.
inline constexpr std::array<std::int64_t, kUploadRefusals> kUploadRefusalWaits_ms = {10'000, 60'000,
                                                                                     60'000};

struct RoomFigures {
  UploadLimits limits;
  std::uint64_t used_bytes = 0;                          // pages in use, as of the last transaction
  std::optional<std::uint64_t> free_disk_bytes;          // none: the system does not tell
  std::array<std::uint64_t, kUploadRefusals> refused{};  // uploads, by reason
  // Why any upload is refused now: the floor, or a store that is full. Ok: none is, but for quotas.
  Status refusing;
};

}  // namespace atlas
