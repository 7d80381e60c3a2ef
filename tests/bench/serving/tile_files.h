// The tiles of an atlas as files for a server of files, and the list of what to ask for.
#pragma once

#include <filesystem>
#include <vector>

#include "client/connection/atlas_client.h"
#include "core/base/status.h"
#include "tests/bench/serving/load_protocol.h"

namespace atlas::testing {

// Every tile that the daemon has now, and the list.
Status WriteTileFiles(const ConnectionOptions& daemon, const std::filesystem::path& directory);
// kInvalidArgument: too few for a batch.
Result<std::vector<LoadTile>> ReadTileList(const std::filesystem::path& directory);

}  // namespace atlas::testing
