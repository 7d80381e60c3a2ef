// What an atlas would be had nothing ever gone wrong: another daemon's, filled anew with what is to
// be in it, each keyframe at the pose that it has now, in another order and in one life.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/bytes.h"
#include "tests/client/ledger/stored_atlas.h"

namespace atlas::testing {

// Its digest once it is fused. Throws where the daemon refuses anything.
Bytes CleanDigest(const StoredAtlas& atlas,
                  const std::filesystem::path& data,
                  const std::vector<std::string>& daemon_flags);

}  // namespace atlas::testing
