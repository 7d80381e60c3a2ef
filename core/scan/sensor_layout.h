// A sensor's channels: how many there are and where they point, learned from its scans.
#pragma once

#include <span>
#include <vector>

#include "core/base/status.h"
#include "core/scan/ego_box.h"
#include "core/scan/rings/ring_splitter.h"

namespace atlas {

// Rows of the range image, lowest first.
struct SensorLayout {
  EgoBox ego;
  // Of each channel that was ever seen or that must lie between or above those; size() is 16, 32
  // or 64.
  std::vector<float> elevation_rad;

  int channels() const { return static_cast<int>(elevation_rad.size()); }
};

// Collects the rings of many scans of one drive: upper rings may see only sky in most of them.
class SensorLayoutEstimator {
 public:
  explicit SensorLayoutEstimator(const EgoBox& ego = {}) : ego_(ego) {}

  void Add(const PointCloud& cloud);
  // Snapped to 16, 32 or 64 channels by angular spacing, empty rings counted. kInvalidData when
  // returns are not stored ring after ring: no scan had two rings, or most fell into tiny pieces.
  Result<SensorLayout> Estimate() const;

 private:
  EgoBox ego_;
  int scans_ = 0;                     // with returns from the world
  int scattered_scans_ = 0;           // whose runs are no rings
  std::vector<float> elevation_rad_;  // rows found so far, lowest first
};

// The row of each run: rows grow with the runs, as near in elevation as that allows. Runs with no
// row of their own (a ring cut in two) share the nearest one.
std::vector<int> AssignRows(const RingSplit& split, std::span<const float> elevation_rad);

}  // namespace atlas
