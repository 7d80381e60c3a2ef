#include "server/store/sqlite/database_files.h"

#include <cerrno>
#include <optional>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/disk_error.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace fs = std::filesystem;
namespace {

constexpr const char* kWhat = "atlas file";

// nullopt: there is none. What cannot be looked at counts as a file that is not empty.
std::optional<std::int64_t> SizeBeside(const fs::path& database, const char* suffix) {
  struct stat found {};
  if (::stat((database.string() + suffix).c_str(), &found) == 0) {
    return found.st_size;
  }
  return errno == ENOENT ? std::nullopt : std::optional<std::int64_t>(1);
}

Status CheckKind(const fs::path& file, const struct stat& found) {
  if (S_ISDIR(found.st_mode)) {
    return {StatusCode::kInvalidArgument,
            StrCat(kWhat, " ", file.string(), ": is a directory, expected the database in it: ",
                   (file / "atlas.db").string())};
  }
  return S_ISREG(found.st_mode)
             ? Status()
             : Status(StatusCode::kInvalidArgument,
                      StrCat(kWhat, " ", file.string(), ": is no file, expected a database"));
}

}  // namespace

Result<DatabaseFiles> DatabaseFiles::Look(const fs::path& file) {
  std::error_code error;
  const fs::path without_links = fs::canonical(file, error);
  if (error) {
    return Error(DiskError(kWhat, file, error.value()));
  }
  return LookAt(without_links);
}

Result<DatabaseFiles> DatabaseFiles::LookAt(const fs::path& file) {
  DatabaseFiles files;
  files.database = file;
  struct stat found {};
  if (::stat(files.database.c_str(), &found) != 0) {
    return Error(DiskError(kWhat, file, errno));
  }
  if (Status status = CheckKind(file, found); !status.ok()) {
    return Error(std::move(status));
  }
  if (::faccessat(AT_FDCWD, files.database.c_str(), R_OK, AT_EACCESS) != 0) {
    return Error(DiskError(kWhat, file, errno));
  }
  files.inode = found.st_ino;
  files.size_bytes = found.st_size;
  files.changed_ns = found.st_mtim.tv_sec * std::int64_t{1'000'000'000} + found.st_mtim.tv_nsec;
  const auto log_bytes = SizeBeside(files.database, "-wal");
  files.has_log = log_bytes.has_value();
  files.is_log_empty = log_bytes.value_or(0) == 0;
  files.has_log_index = SizeBeside(files.database, "-shm").has_value();
  files.has_journal = SizeBeside(files.database, "-journal").value_or(0) != 0;
  return files;
}

}  // namespace atlas
