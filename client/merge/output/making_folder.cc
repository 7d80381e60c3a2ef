#include "client/merge/output/making_folder.h"

#include <cerrno>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/disk_error.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

fs::path FolderOf(const fs::path& target) {
  return target.has_parent_path() ? target.parent_path() : fs::path(".");
}

std::string PrefixOf(const fs::path& target) {
  return StrCat(".", target.filename().string(), ".merging-");
}

// What cannot be looked at or removed stays: nobody takes it for an atlas.
void RemoveAbandoned(const fs::path& target) {
  const std::string prefix = PrefixOf(target);
  std::error_code error;
  for (fs::directory_iterator entry(FolderOf(target), error), end; !error && entry != end;
       entry.increment(error)) {
    if (!std::string_view(entry->path().filename().native()).starts_with(prefix)) continue;
    const auto lock = FolderLock::Take(entry->path());
    std::error_code ignored;
    if (lock) fs::remove_all(entry->path(), ignored);
  }
}

}  // namespace

Result<std::unique_ptr<MakingFolder>> MakingFolder::Make(const fs::path& target) {
  RemoveAbandoned(target);
  std::string path = (FolderOf(target) / StrCat(PrefixOf(target), "XXXXXX")).string();
  if (::mkdtemp(path.data()) == nullptr) return Error(DiskError("cannot make", path, errno));
  auto lock = FolderLock::Take(path);
  if (!lock) return Error(lock.error());
  std::unique_ptr<MakingFolder> folder(new MakingFolder(path, *std::move(lock)));
  for (const fs::path& inner : {folder->data(), folder->backups()}) {
    std::error_code error;
    fs::create_directory(inner, error);
    if (error) return Error(DiskError("cannot make", inner, error.value()));
  }
  return folder;
}

MakingFolder::~MakingFolder() {
  std::error_code ignored;  // what cannot be removed stays, until the file is made once more
  fs::remove_all(path_, ignored);
}

}  // namespace atlas
