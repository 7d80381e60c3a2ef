#include "client/merge/memory/temporary_folder.h"

#include <cerrno>
#include <cstdlib>
#include <system_error>
#include <utility>

#include <sys/stat.h>
#include <unistd.h>

#include "core/base/disk_error.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

// A folder of ours, no link to one, that was locked once.
bool MayBeAbandoned(const fs::path& path, std::chrono::seconds least_age) {
  struct stat found {};
  if (::lstat(path.c_str(), &found) != 0 || !S_ISDIR(found.st_mode)) return false;
  if (found.st_uid != ::geteuid()) return false;
  std::error_code error;
  const fs::file_time_type made = fs::last_write_time(path / "lock", error);
  return !error && fs::file_time_type::clock::now() - made > least_age;
}

void RemoveAbandoned(const TemporaryPlace& place) {
  std::error_code error;
  for (fs::directory_iterator entry(place.among, error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path& path = entry->path();
    const bool is_named_so = path.filename().native().starts_with(place.prefix);
    if (!is_named_so || !MayBeAbandoned(path, place.least_age)) continue;
    const auto lock = FolderLock::Take(path);
    std::error_code ignored;
    if (lock) fs::remove_all(path, ignored);
  }
}

}  // namespace

Result<TemporaryFolder> MakeTemporaryFolder(const TemporaryPlace& place) {
  RemoveAbandoned(place);
  std::string path = (place.among / StrCat(place.prefix, "XXXXXX")).string();
  if (::mkdtemp(path.data()) == nullptr) {
    return Error(DiskError("cannot make folder", path, errno));
  }
  auto lock = FolderLock::Take(path);
  if (!lock) return Error(lock.error());
  return TemporaryFolder{path, *std::move(lock)};
}

}  // namespace atlas
