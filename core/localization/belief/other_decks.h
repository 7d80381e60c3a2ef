// The other surfaces of the map above and below a place: a garage looks much the same from each.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/localization/registration/scan_features.h"
#include "core/localization/window/map_window.h"

namespace atlas {

struct DeckOptions {
  double reach_m = 12.0;        // looked for so far above and below
  double apart_m = 1.5;         // surfaces closer than this are one
  double least_m = 1.5;         // closer than this is the place's own
  float near_m = 12.0F;         // of the scan's ground: what lies so near the sensor
  std::size_t min_ground = 10;  // features of it; fewer say nothing
  double min_share = 0.3;       // of these that a deck has to carry
  std::size_t most = 4;
};

class DeckFinder {
 public:
  explicit DeckFinder(const DeckOptions& options) : options_(options) {}

  // How far up (metres, down is negative) the scan would lie on another surface, the one that
  // carries most of its ground first. `T_world_level` is where it is taken to be. Valid until the
  // next call.
  const std::vector<double>& Find(const MapWindow& map,
                                  const ScanFeatures& features,
                                  const Pose& T_world_level);

 private:
  struct Deck {
    double up_m = 0.0;
    int carried = 0;  // of ground_
  };

  Deck DeckAt(const MapWindow& map, double up_m) const;

  DeckOptions options_;
  // Of the scan's ground that lies near the sensor, in the window's frame. All kept for their
  // memory.
  std::vector<Eigen::Vector3f> ground_;
  std::vector<Deck> decks_;
  std::vector<double> ups_m_;
};

}  // namespace atlas
