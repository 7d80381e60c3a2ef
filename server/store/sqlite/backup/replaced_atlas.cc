#include "server/store/sqlite/backup/replaced_atlas.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "core/base/disk_error.h"
#include "core/base/str_cat.h"
#include "server/store/sqlite/backup/atlas_copy.h"

namespace atlas {
namespace fs = std::filesystem;
namespace {

// The database first: a log is of no use to another one, and does harm; nor is the note.
constexpr std::array kSuffixes = {"", "-wal", "-shm", "-journal", "-revision"};

bool IsThere(const fs::path& file) {
  std::error_code error;
  return fs::exists(fs::symlink_status(file, error));
}

fs::path Numbered(const fs::path& database, int number) {
  return StrCat(database.string(), ".replaced-", number);
}

fs::path NameFor(const fs::path& database) {
  int number = 1;
  while (IsThere(Numbered(database, number))) {
    ++number;
  }
  const bool is_a_rest = !IsThere(database) && number > 1;
  return Numbered(database, is_a_rest ? number - 1 : number);
}

using Renames = std::vector<std::pair<fs::path, fs::path>>;

void Undo(const Renames& done) {
  for (auto rename = done.rbegin(); rename != done.rend(); ++rename) {
    std::error_code ignored;  // whoever comes next finds it under the other name
    fs::rename(rename->second, rename->first, ignored);
  }
}

}  // namespace

Result<fs::path> MoveAside(const fs::path& database) {
  const fs::path kept = NameFor(database);
  Renames done;
  for (const char* suffix : kSuffixes) {
    const fs::path from = database.string() + suffix;
    const fs::path to = kept.string() + suffix;
    if (!IsThere(from)) {
      continue;
    }
    if (std::rename(from.c_str(), to.c_str()) != 0) {
      Status status = DiskError("cannot rename", from, errno);
      Undo(done);
      return Error(std::move(status));
    }
    done.emplace_back(from, to);
  }
  if (done.empty()) {
    return fs::path();
  }
  if (Status status = SyncFolder(database.parent_path()); !status.ok()) {
    Undo(done);
    return Error(std::move(status));
  }
  return kept;
}

}  // namespace atlas
