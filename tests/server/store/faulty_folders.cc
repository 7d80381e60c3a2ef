// Calls to the system that SQLite's layer does not see: a file gets another name, a folder is
// synced. In the place of the system's for all of this program, its libraries too.
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <string>

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "tests/server/store/fault_plan.h"

namespace {

using Calls = atlas::FaultyVfs::Calls;

bool IsFolder(int fd) {
  struct stat found {};
  return fstat(fd, &found) == 0 && S_ISDIR(found.st_mode);
}

std::filesystem::path PathOf(int fd) {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(fd), error);
}

int FailWith(int error) {
  errno = error;
  return -1;
}

}  // namespace

extern "C" {

int rename(const char* from, const char* to) noexcept {
  if (atlas::IsToFail(Calls::kAll, "rename", from)) {
    return FailWith(EIO);
  }
  atlas::TheFiles().NoteRename(from, to);
  return renameat(AT_FDCWD, from, AT_FDCWD, to);
}

int fsync(int fd) {
  if (IsFolder(fd)) {
    const std::filesystem::path folder = PathOf(fd);
    if (atlas::IsToFail(Calls::kSync, "sync", folder)) {
      return FailWith(EIO);
    }
    atlas::TheFiles().NoteFolderSync(folder);
  }
  return static_cast<int>(syscall(SYS_fsync, fd));
}
}
