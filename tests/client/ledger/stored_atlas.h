// All that a data folder holds, read through the store itself while no daemon has it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>

#include "core/geometry/keyframe_key.h"
#include "core/geometry/pose.h"
#include "server/store/session_types.h"

namespace atlas::testing {

struct StoredFrame {
  std::int64_t time_ms = 0;
  QuantizedPose pose;
  std::uint64_t blob_hash = 0;
};

struct StoredAtlas {
  std::map<KeyframeKey, StoredFrame> frames;
  std::map<SessionKey, SessionState> states;
  std::uint64_t twice = 0;  // rows under a key that has one
};

// Throws where anything cannot be read, where a checksum or a counter is wrong.
StoredAtlas ReadStoredAtlas(const std::filesystem::path& data);

}  // namespace atlas::testing
