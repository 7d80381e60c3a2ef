// A map damaged on purpose: columns turned into their opposite, cars moved, a building gone. What
// was changed is known, segment by segment.
#pragma once

#include <cstdint>
#include <map>
#include <span>

#include <Eigen/Core>

#include "client/map/map_source.h"
#include "core/base/status.h"
#include "core/geometry/tile_id.h"
#include "core/tile/tile.h"
#include "tests/bench/localization/memory_map.h"
#include "tests/bench/monitoring/changed_segments.h"

namespace atlas::testing {

struct DamageOptions {
  // Of all columns, in squares of `square_m`: where something stands in a square it is taken away;
  // where nothing does every segment that is known to be free becomes occupied.
  double column_share = 0.0;
  double square_m = 2.0;
  int cars = 0;  // so many are taken away, and so many put elsewhere
  bool is_building_gone = false;
  std::uint64_t seed = 1;
};

class DamagedMap : public MemoryMap {
 public:
  // `way`: where the vehicle will drive (places of its sensor); cars and the building are chosen
  // along it. Errors are those of the source.
  static Result<DamagedMap> Make(MapSource& whole,
                                 std::span<const Eigen::Vector3d> way,
                                 const DamageOptions& options);

  const ChangedSegments& changes() const { return changes_; }
  std::size_t cars_gone() const { return cars_gone_; }
  std::size_t cars_put() const { return cars_put_; }

 private:
  using MemoryMap::MemoryMap;

  ChangedSegments changes_;
  std::size_t cars_gone_ = 0;
  std::size_t cars_put_ = 0;
};

}  // namespace atlas::testing
