// What the raw scans of a street say about its 1 m squares, traced ray by ray in floating point:
// the judge of the map, which shares no code with it.
#pragma once

#include <cstdint>
#include <map>
#include <utility>

#include "tests/data/street_map.h"

namespace atlas::testing {

// Returns within 20 m of the sensor and 0.5 to 2 m above the road at the nearest pose.
struct StreetSquare {
  double road_m = 0.0;
  int scans_with_20 = 0;      // with 20 such returns or more
  int scans_with_20_own = 0;  // of which 0.3 m or more above the square's own ground: lawns are not
  int scans_looking = 0;      // 20 rays or more enter the square at that height
  int scans_present = 0;      // of which some end there, 0.3 m or more above its own ground

  // 20 returns in 5 scans: what the map is asked for.
  bool is_asked_for() const { return scans_with_20 >= 5; }
  // What rises above the square's own ground, not the ground itself.
  bool rises() const { return scans_with_20_own >= 5; }
  // What is gone in most scans that look there moved: pedestrians, cyclists, cars.
  bool stands() const { return rises() && 2 * scans_present >= scans_looking; }
};

// Squares [x, x + 1) x [y, y + 1) whose middle is 3 to 10 m from the path, by (x, y).
std::map<std::pair<std::int64_t, std::int64_t>, StreetSquare> JudgeSquares(const StreetMap& street);

}  // namespace atlas::testing
