// Keyframes that are not on disk as they were written, and what becomes of them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/pose.h"
#include "core/geometry/tile_id.h"

namespace atlas {

// Out of the map until its vehicle sends the same bytes again or somebody gives it up.
struct DamagedKeyframe {
  std::int64_t id = 0;
  std::uint64_t revision = 0;  // of the atlas when it was found
  std::int64_t time_ms = 0;    // Unix time
  std::string reason;
};

struct KeyframeRepair {
  std::int64_t id = 0;
  std::string author;
  // The level-0 tiles at `pose`, where that can be read: in the place of a list that is damaged.
  std::optional<std::vector<TileId>> footprint;
  // What cannot be restored is deleted: it was never uploaded then.
  bool gives_up = false;
  // At which it was when its footprint was told. If it is corrected before it is repaired, nothing
  // is done: it stays kDamaged, and is to be asked for again.
  QuantizedPose pose = {};
};

// The last two before keyframes are repaired and after it.
enum class TableRepair {
  // Indexes alone, where the rows that they are made of are whole: kInvalidData else. Every tile is
  // marked then: what was fused since an index gave wrong answers nobody knows.
  kIndexes,
  kRows,  // sessions, counters, marks and indexes, by what other rows say
  kSums,  // then what is counted, and what every table should hold, by the rows that are there
};

enum class RepairOutcome { kIntact, kRestored, kGivenUp, kDamaged };

}  // namespace atlas
