// Cells of one place where one side of a comparison has something standing and the other has
// nothing, and what hangs together of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "client/merge/changes/map_change.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/tile_id.h"
#include "core/localization/window/map_window.h"

namespace atlas {

struct ChangeOptions {
  // Something stands there for the other side too, if it has anything standing so near: poses and
  // walls are off by some centimetres.
  double reach_m = 0.3;
  double together_m = 0.5;        // cells this near are one thing
  std::size_t min_segments = 12;  // a thing has at least, so many cells of a metre's height
};

struct StandingCell {
  ChangedCell cell;
  float low_m = 0.0F;  // of its segments, world frame
  float high_m = 0.0F;
  std::uint32_t segments = 0;
};

// Of `place` (level 0), what stands in `standing` where `other` knows that nothing does.
void AddStandingCells(const MapWindow& standing,
                      const MapWindow& other,
                      const TileId& place,
                      const MapProfile& profile,
                      const ChangeOptions& options,
                      std::vector<StandingCell>& cells);

// Things of `cells`, which are of one kind, from the largest on.
std::vector<MapChange> GroupCells(std::vector<StandingCell> cells,
                                  ChangeKind kind,
                                  double cell_size_m,
                                  const ChangeOptions& options);

}  // namespace atlas
