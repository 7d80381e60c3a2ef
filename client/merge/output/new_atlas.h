// An atlas that a merge makes: by a daemon of its own, beside the file that it becomes.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "client/connection/atlas_client.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"

namespace atlas {

struct NewAtlasPlan {
  std::filesystem::path target;               // nothing stands there
  std::optional<std::filesystem::path> base;  // a backup that it begins as a copy of; none: empty
  MapProfile profile;  // of the base, or of what is to come into an empty one
};

class NewAtlas {
 public:
  // A step, and how much of it is done. A failed status ends it.
  using Progress = std::function<Status(std::string_view step, std::size_t done, std::size_t all)>;

  // Needs room beside the target for the atlas and a copy of it. kConflict: something stands there.
  // kUnsupported: no daemon makes atlases of that profile. Else errors are those of the disk, of
  // RestoreBackup and of OwnDaemon.
  static Result<NewAtlas> Begin(const NewAtlasPlan& plan, const Progress& progress);
  NewAtlas(NewAtlas&&) noexcept;
  NewAtlas& operator=(NewAtlas&&) noexcept;
  NewAtlas(const NewAtlas&) = delete;
  NewAtlas& operator=(const NewAtlas&) = delete;
  // What was not finished is gone.
  ~NewAtlas();

  AtlasClient& client();

  // Once: all of it is fused, copied, read back, and stands at its place. kConflict: something came
  // to stand there. Else errors are those of the disk and of AtlasClient.
  Result<BackupSummary> Finish(const std::string& author, const Progress& progress);

 private:
  class Making;
  explicit NewAtlas(std::unique_ptr<Making> making);

  std::unique_ptr<Making> making_;
};

}  // namespace atlas
