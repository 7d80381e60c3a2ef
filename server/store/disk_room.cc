#include "server/store/disk_room.h"

#include <system_error>

#include "core/base/disk_error.h"

namespace atlas {

Result<std::uint64_t> DiskRoom::FreeBytes(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (!is_read_ || now - read_at_ >= kFresh) {
    free_bytes_ = read_();
    read_at_ = now;
    is_read_ = true;
  }
  return free_bytes_;
}

Result<std::uint64_t> ReadFreeBytes(const std::filesystem::path& directory) {
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(directory, error);
  if (error) {
    return Error(DiskError("cannot ask for the room at", directory, error.value()));
  }
  return std::uint64_t{space.available};
}

}  // namespace atlas
