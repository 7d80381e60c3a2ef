#include "server/store/sqlite/data_directory.h"

#include <array>
#include <cerrno>
#include <chrono>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "core/base/disk_error.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace fs = std::filesystem;
namespace {

// The index of the log has 32 KiB; the rest is for what file systems round up.
constexpr off_t kRoomBytes = 64 * 1024;

std::string ReadHolder(int fd) {
  std::array<char, 32> text{};
  const ssize_t size = ::pread(fd, text.data(), text.size() - 1, 0);
  std::string holder(text.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
  while (!holder.empty() && holder.back() == '\n') {
    holder.pop_back();
  }
  return holder.empty() ? "unknown" : holder;
}

// The process id is for people; a disk too full for it does not matter.
void WriteHolder(int fd) {
  const std::string text = StrCat(::getpid(), "\n");
  if (::ftruncate(fd, 0) == 0) {
    [[maybe_unused]] const ssize_t written = ::pwrite(fd, text.data(), text.size(), 0);
  }
}

// A daemon that was killed holds its lock until the system has buried it.
bool TryLock(int fd) {
  constexpr int kTries = 20;
  constexpr std::chrono::milliseconds kPause(50);
  for (int i = 1; ::flock(fd, LOCK_EX | LOCK_NB) != 0; ++i) {
    if (i == kTries) {
      return false;
    }
    std::this_thread::sleep_for(kPause);
  }
  return true;
}

Status CheckContents(const fs::path& directory) {
  std::error_code error;
  for (fs::directory_iterator it(directory, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (name != "lock" && !name.starts_with("atlas.db") && name != "surveys" &&
        name != "lost+found") {
      return Status(StatusCode::kInvalidArgument,
                    StrCat("data directory ", directory.string(), " holds '", name,
                           "' but no atlas; expected an atlas, or an empty or missing directory"));
    }
  }
  return error ? DiskError("data directory", directory, error.value()) : Status();
}

// Makes it where it is missing.
Status MakeDirectory(const fs::path& directory) {
  std::error_code error;
  fs::create_directories(directory, error);
  if (!error) {
    return {};
  }
  const Status failure = DiskError("data directory", directory, error.value());
  if (failure.code() != StatusCode::kConflict) {
    return failure;
  }
  // It, or what it should be in, is a file: nobody else's doing, the path is wrong.
  return {StatusCode::kInvalidArgument,
          failure.message() + "; expected a directory, or a path at which one can be made"};
}

}  // namespace

Result<DataDirectory> DataDirectory::Lock(const fs::path& directory) {
  if (Status status = MakeDirectory(directory); !status.ok()) {
    return Error(std::move(status));
  }
  std::error_code error;
  if (!fs::exists(directory / "atlas.db", error)) {
    if (Status status = CheckContents(directory); !status.ok()) {
      return Error(std::move(status));
    }
  }
  if (fs::is_symlink(directory / "atlas.db", error)) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("data directory: ", (directory / "atlas.db").string(),
                        " is a symbolic link, and its log would stand beside what it leads to: "
                        "link the directory instead, or start the daemon on the other one"));
  }
  const fs::path lock = directory / "lock";
  const int fd = ::open(lock.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (fd < 0) {
    return Error(DiskError("data directory: cannot open", lock, errno));
  }
  const int directory_fd = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (directory_fd < 0) {
    Status status = DiskError("data directory: cannot open", directory, errno);
    ::close(fd);
    return Error(std::move(status));
  }
  if (!TryLock(fd) || !TryLock(directory_fd)) {
    Status status(StatusCode::kConflict, StrCat("data directory ", directory.string(),
                                                " is in use by process ", ReadHolder(fd)));
    ::close(directory_fd);
    ::close(fd);
    return Error(std::move(status));
  }
  WriteHolder(fd);
  return DataDirectory(directory, directory_fd, fd);
}

DataDirectory::DataDirectory(fs::path directory, int directory_fd, int lock_fd)
    : directory_(std::move(directory)), directory_fd_(directory_fd), lock_fd_(lock_fd) {}

DataDirectory::DataDirectory(DataDirectory&& other) noexcept
    : directory_(std::move(other.directory_)),
      directory_fd_(std::exchange(other.directory_fd_, -1)),
      lock_fd_(std::exchange(other.lock_fd_, -1)),
      keeps_room_(other.keeps_room_) {}

DataDirectory::~DataDirectory() {
  if (lock_fd_ < 0) {
    return;
  }
  if (keeps_room_ && has_atlas()) {
    KeepRoom();
  }
  ::close(lock_fd_);
  ::close(directory_fd_);
}

void DataDirectory::FreeRoom() {
  std::error_code ignored;  // of what cannot be removed there is none
  fs::remove(room_file(), ignored);
  keeps_room_ = true;
}

void DataDirectory::KeepRoom() const {
  const int fd = ::open(room_file().c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (fd < 0) {
    return;
  }
  const bool is_kept = ::posix_fallocate(fd, 0, kRoomBytes) == 0;
  ::close(fd);
  if (!is_kept) {
    std::error_code ignored;
    fs::remove(room_file(), ignored);
  }
}

bool DataDirectory::has_atlas() const {
  std::error_code error;
  return fs::exists(database_file(), error);
}

void DataDirectory::RemoveUnfinished() const {
  for (const char* suffix : {"", "-journal", "-wal", "-shm"}) {
    std::error_code error;  // what cannot be removed is met again when it is written
    fs::remove(unfinished_file().string() + suffix, error);
  }
}

Status DataDirectory::Publish() const {
  if (::rename(unfinished_file().c_str(), database_file().c_str()) != 0) {
    return DiskError("data directory: cannot rename", unfinished_file(), errno);
  }
  const int fd = ::open(directory_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) {
    return DiskError("data directory: cannot open", directory_, errno);
  }
  const int synced = ::fsync(fd);
  const int error = errno;
  ::close(fd);
  return synced == 0 ? Status() : DiskError("data directory: cannot sync", directory_, error);
}

std::uint64_t DataDirectory::StoreBytes() const {
  std::uint64_t bytes = 0;
  for (const char* suffix : {"", "-wal"}) {
    std::error_code error;
    const auto size = fs::file_size(database_file().string() + suffix, error);
    bytes += error ? 0 : size;
  }
  return bytes;
}

}  // namespace atlas
