// The folder of an atlas on a vehicle's disk (docs/formats/vehicle.md): which atlas it is of, and
// when it was opened last.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/bytes.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"

namespace atlas {

inline constexpr std::size_t kAtlasIdBytes = 16;

struct AtlasKey {
  Bytes atlas_id;  // kAtlasIdBytes
  MapProfile profile;

  // kInvalidArgument: an id that is none.
  Status Validate() const;
  friend bool operator==(const AtlasKey&, const AtlasKey&) = default;
};

// Of the file that says which atlas a folder is of.
inline constexpr std::string_view kAtlasFileName = "atlas";

// The atlases with a folder below `root`, the one that was opened last first.
std::vector<AtlasKey> KnownAtlases(const std::filesystem::path& root);

// The folders below `root` that have the name of one, the one opened longest ago first, whether
// they say which atlas they are of or not.
std::vector<std::filesystem::path> AtlasFolders(const std::filesystem::path& root);

// Makes the folder if there is none, and is the last one opened then, as far as the disk lets it
// be written down. One of another profile is emptied. kInvalidArgument: an id that is none.
Result<std::filesystem::path> OpenAtlasFolder(const std::filesystem::path& root,
                                              const AtlasKey& atlas);

}  // namespace atlas
