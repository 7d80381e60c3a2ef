#include "server/store/sqlite/backup/atlas_copy.h"

#include <cerrno>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

#include "core/base/disk_error.h"
#include "core/base/str_cat.h"
#include "server/store/sqlite/backup/work_pace.h"
#include "server/store/sqlite/connection/page_copy.h"

namespace atlas {
namespace fs = std::filesystem;
namespace {

constexpr int kStepPages = 128;  // 1 MiB: a millisecond or so
constexpr int kCache_kib = 4 * 1024;

}  // namespace

fs::path PartialOf(const fs::path& file) {
  return file.string() + ".partial";
}

void RemovePartial(const fs::path& file) {
  for (const char* suffix : {"", "-journal", "-wal", "-shm"}) {
    std::error_code ignored;  // what cannot be removed is met again when it is written
    fs::remove(PartialOf(file).string() + suffix, ignored);
  }
}

Status RequireRoom(const fs::path& folder, std::uint64_t bytes, std::uint64_t reserve) {
  if (::faccessat(AT_FDCWD, folder.c_str(), W_OK, AT_EACCESS) != 0) {
    return DiskError("cannot write to", folder, errno);
  }
  std::error_code error;
  const fs::space_info room = fs::space(folder, error);
  if (error) {
    return DiskError("folder", folder, error.value());
  }
  if (room.available >= bytes + reserve) {
    return {};
  }
  return {StatusCode::kResourceExhausted,
          StrCat("not enough room in ", folder.string(), ": the copy takes ", bytes, " bytes and ",
                 reserve, " are to stay free, ", room.available, " are there")};
}

Status CopyAtlas(Connection& from, const fs::path& file, const BackupWork& work) {
  RemovePartial(file);
  Connection to({PartialOf(file), DatabaseOptions::Mode::kCreate, kCache_kib, 0});
  to.Execute("PRAGMA journal_mode = OFF");  // half a copy is none
  PageCopy copy(from, to);
  const auto page_bytes = static_cast<std::uint64_t>(from.Ask("PRAGMA page_size"));
  const auto pages = static_cast<std::uint64_t>(from.Ask("PRAGMA page_count"));
  WorkPace pace(work, BackupProgress::Stage::kCopying, pages * page_bytes);
  for (bool is_whole = false; !is_whole;) {
    is_whole = copy.Step(kStepPages);
    const auto done = static_cast<std::uint64_t>(copy.total() - copy.left());
    ATLAS_RETURN_IF_ERROR(pace.Reach(done * page_bytes));
  }
  return {};
}

Status PublishCopy(const fs::path& file) {
  if (::rename(PartialOf(file).c_str(), file.c_str()) != 0) {
    return DiskError("cannot rename", PartialOf(file), errno);
  }
  return SyncFolder(file.parent_path());
}

Status SyncFolder(const fs::path& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) {
    return DiskError("cannot open", folder, errno);
  }
  const int synced = ::fsync(fd);
  const int error = errno;
  ::close(fd);
  return synced == 0 ? Status() : DiskError("cannot sync", folder, error);
}

}  // namespace atlas
