// The digest of the whole atlas as it was at one revision (atlas_digest.h).
#pragma once

#include <filesystem>

#include "core/base/status.h"
#include "server/service/history/past_tiles.h"
#include "server/service/verification/atlas_digest.h"

namespace atlas {

// Every tile is fused once. A digest goes level by level and fusion depth first: the coarser levels
// wait in files without names in `scratch`, about a third of what the atlas's tiles take on disk.
Result<AtlasDigest> ComputePastDigest(AtlasStore& store,
                                      const PastOptions& options,
                                      const std::filesystem::path& scratch);

}  // namespace atlas
