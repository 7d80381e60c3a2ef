// The keyframes of a recorded drive, as it is ingested: one a metre at most, 16 rings, 20 m.
#pragma once

#include <filesystem>
#include <vector>

#include "core/base/status.h"
#include "core/fusion/tile_fusion.h"
#include "core/geometry/map_profile.h"

namespace atlas::testing {

// Errors are those of reading the folder.
Result<std::vector<PlacedKeyframe>> ReadKeyframes(const std::filesystem::path& folder,
                                                  const MapProfile& profile);

}  // namespace atlas::testing
