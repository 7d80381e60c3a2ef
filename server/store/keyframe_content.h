// Keyframes of a session as they were uploaded, read back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/bytes.h"
#include "core/base/status.h"
#include "core/geometry/pose.h"
#include "server/store/store_types.h"

namespace atlas {

struct KeyframeContent {
  std::uint32_t sequence = 0;
  std::int64_t time_ms = 0;                 // since 1970
  QuantizedPose pose = {};                  // as it is now
  std::optional<PositionPrior> prior = {};  // that it was uploaded with
  Bytes blob = {};
  // Not ok: its row, its pose or its blob is damaged, and only its sequence number is known.
  Status damage = {};
};

// What one counts for besides its blob: more than it takes in a frame.
inline constexpr std::size_t kKeyframeBesidesBlobBytes = 320;

// Of one snapshot, by rising sequence number.
struct KeyframeContents {
  std::vector<KeyframeContent> keyframes;
  // What the next one counts for, which had no room; nullopt: there is none.
  std::optional<std::size_t> next_bytes = {};
};

}  // namespace atlas
