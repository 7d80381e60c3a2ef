// A folder that one program uses at a time: a lock (flock) on the file `lock` in it, which the
// system takes back when its holder ends, however it ends. A child that is forked and goes on
// without exec holds it, too. One object in one place: two in one program exclude each other as
// well.
#pragma once

#include <filesystem>

#include "core/base/status.h"

namespace atlas {

class FolderLock {
 public:
  // Does not wait. kConflict names the folder: somebody else has it. Else what the disk said.
  static Result<FolderLock> Take(const std::filesystem::path& folder);

  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&& other) noexcept;
  ~FolderLock();

 private:
  explicit FolderLock(int fd) : fd_(fd) {}

  int fd_;  // -1: moved from
};

}  // namespace atlas
