// How much is free on the atlas's file system, asked for at most once a second: the writer asks for
// each upload. Thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <utility>

#include "core/base/status.h"

namespace atlas {

class DiskRoom {
 public:
  using Clock = std::chrono::steady_clock;
  using Read = std::function<Result<std::uint64_t>()>;

  static constexpr std::chrono::seconds kFresh{1};

  explicit DiskRoom(Read read) : read_(std::move(read)) {}

  // As it was less than a second before `now`.
  Result<std::uint64_t> FreeBytes(Clock::time_point now);

 private:
  const Read read_;
  std::mutex mutex_;
  Clock::time_point read_at_;
  Result<std::uint64_t> free_bytes_ = Error(StatusCode::kUnavailable, "not asked yet");
  bool is_read_ = false;
};

// What the file system of `directory` leaves to who is not root. Errors as DiskError.
Result<std::uint64_t> ReadFreeBytes(const std::filesystem::path& directory);

}  // namespace atlas
