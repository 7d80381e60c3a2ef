// One number for the whole atlas: equal exactly when all tiles of all levels are.
#pragma once

#include <array>
#include <cstdint>
#include <functional>

#include "core/base/status.h"
#include "server/store/atlas_store.h"

namespace atlas {

struct AtlasDigest {
  std::array<std::uint8_t, 32> sha256{};
  std::uint64_t tiles = 0;
  std::uint64_t revision = 0;
};

// SHA-256 over the tiles in key order, each as key (8 bytes big-endian), length (8 bytes
// big-endian), canonical uncompressed payload. The state it read may be a mix when the atlas
// changed meanwhile: compare revisions before and after. kInvalidData names a damaged tile. A
// failed status of `check_stop`, asked between tiles, ends it.
Result<AtlasDigest> ComputeDigest(AtlasStore& store, const std::function<Status()>& check_stop);

}  // namespace atlas
