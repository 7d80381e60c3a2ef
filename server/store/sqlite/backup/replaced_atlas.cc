#include "server/store/sqlite/backup/replaced_atlas.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
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
  return StrCat(database.string(), kReplaced, number);
}

// Of all that is kept beside it, be it a log alone; 0: nothing is.
int LastNumber(const fs::path& database) {
  const std::string begin = StrCat(database.filename().string(), kReplaced);
  int last = 0;
  std::error_code error;
  for (fs::directory_iterator it(database.parent_path(), error), end; !error && it != end;
       it.increment(error)) {
    const std::string name = it->path().filename().string();
    int number = 0;
    if (name.starts_with(begin)) {
      std::from_chars(name.data() + begin.size(), name.data() + name.size(), number);
    }
    last = std::max(last, number);
  }
  return last;
}

// Whether `database` is not there, and `kept` is, without what is left of that one. SQLite makes
// the index of a log anew.
bool LacksWhatIsLeft(const fs::path& database, const fs::path& kept) {
  return !IsThere(database) && IsThere(kept) &&
         std::none_of(kSuffixes.begin(), kSuffixes.end(), [&](const std::string& suffix) {
           return suffix != "-shm" && IsThere(database.string() + suffix) &&
                  IsThere(kept.string() + suffix);
         });
}

fs::path NameFor(const fs::path& database, const MayFollowKept& may_follow) {
  const int last = LastNumber(database);
  const fs::path kept = Numbered(database, last);
  return LacksWhatIsLeft(database, kept) && may_follow(kept) ? kept : Numbered(database, last + 1);
}

using Renames = std::vector<std::pair<fs::path, fs::path>>;

void Undo(const Renames& done) {
  for (auto rename = done.rbegin(); rename != done.rend(); ++rename) {
    std::error_code ignored;  // whoever comes next finds it under the other name
    fs::rename(rename->second, rename->first, ignored);
  }
}

// SQLite makes the index of a log anew.
KeptAtlas WhatIsKept(const fs::path& kept, const Renames& done) {
  if (IsThere(kept)) {
    return {kept, {}};
  }
  KeptAtlas atlas;
  for (const auto& [from, to] : done) {
    if (!to.native().ends_with("-shm")) {
      atlas.left.push_back(to);
    }
  }
  return atlas;
}

}  // namespace

Result<KeptAtlas> MoveAside(const fs::path& database, const MayFollowKept& may_follow) {
  const fs::path kept = NameFor(database, may_follow);
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
  if (!done.empty()) {
    if (Status status = SyncFolder(database.parent_path()); !status.ok()) {
      Undo(done);
      return Error(std::move(status));
    }
  }
  return WhatIsKept(kept, done);
}

}  // namespace atlas
