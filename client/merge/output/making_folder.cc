#include "client/merge/output/making_folder.h"

#include <utility>

#include "core/base/disk_error.h"
#include "core/base/str_cat.h"

namespace atlas {

namespace fs = std::filesystem;

Result<std::unique_ptr<MakingFolder>> MakingFolder::Make(const fs::path& target) {
  const fs::path beside = target.has_parent_path() ? target.parent_path() : fs::path(".");
  const std::string prefix = StrCat(".", target.filename().string(), ".merging-");
  auto made = MakeTemporaryFolder({beside, prefix, std::chrono::seconds(10)});
  if (!made) return Error(made.error());
  std::unique_ptr<MakingFolder> folder(new MakingFolder(*std::move(made)));
  for (const fs::path& inner : {folder->data(), folder->backups()}) {
    std::error_code error;
    fs::create_directory(inner, error);
    if (error) return Error(DiskError("cannot make", inner, error.value()));
  }
  return folder;
}

MakingFolder::~MakingFolder() {
  std::error_code ignored;  // what cannot be removed stays, until the file is made once more
  fs::remove_all(folder_.path, ignored);
}

}  // namespace atlas
