// A hidden folder beside a file that is being made. It goes with its owner; what one left that was
// killed goes with the next that makes the same file.
#pragma once

#include <filesystem>
#include <memory>
#include <utility>

#include "client/merge/memory/temporary_folder.h"
#include "core/base/status.h"

namespace atlas {

class MakingFolder {
 public:
  // `.NAME.merging-XXXXXX` beside `target`, and in it the two below. Errors are those of the disk.
  static Result<std::unique_ptr<MakingFolder>> Make(const std::filesystem::path& target);

  MakingFolder(const MakingFolder&) = delete;
  MakingFolder& operator=(const MakingFolder&) = delete;
  MakingFolder(MakingFolder&&) = delete;
  MakingFolder& operator=(MakingFolder&&) = delete;
  // With everything in it.
  ~MakingFolder();

  std::filesystem::path data() const { return folder_.path / "data"; }
  std::filesystem::path backups() const { return folder_.path / "backups"; }

 private:
  explicit MakingFolder(TemporaryFolder folder) : folder_(std::move(folder)) {}

  TemporaryFolder folder_;
};

}  // namespace atlas
