#include "client/merge/memory/temporary_folder.h"

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <sys/stat.h>
#include <unistd.h>

#include "core/base/disk_error.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "atlas-merge.";
// Before it is locked a new one is as an abandoned one.
constexpr std::chrono::hours kLeastAge{1};

// A folder of ours, no link to one, that was locked once.
bool MayBeAbandoned(const fs::path& path) {
  struct stat found {};
  if (::lstat(path.c_str(), &found) != 0 || !S_ISDIR(found.st_mode)) return false;
  if (found.st_uid != ::geteuid()) return false;
  std::error_code error;
  const fs::file_time_type made = fs::last_write_time(path / "lock", error);
  return !error && fs::file_time_type::clock::now() - made > kLeastAge;
}

void RemoveAbandoned(const fs::path& among) {
  std::error_code error;
  for (fs::directory_iterator entry(among, error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path& path = entry->path();
    if (!path.filename().native().starts_with(kPrefix) || !MayBeAbandoned(path)) continue;
    const auto lock = FolderLock::Take(path);
    std::error_code ignored;
    if (lock) fs::remove_all(path, ignored);
  }
}

}  // namespace

Result<TemporaryFolder> MakeTemporaryFolder(const fs::path& among) {
  RemoveAbandoned(among);
  std::string path = (among / StrCat(kPrefix, "XXXXXX")).string();
  if (::mkdtemp(path.data()) == nullptr) {
    return Error(DiskError("cannot make folder", path, errno));
  }
  auto lock = FolderLock::Take(path);
  if (!lock) return Error(lock.error());
  return TemporaryFolder{path, *std::move(lock)};
}

}  // namespace atlas
