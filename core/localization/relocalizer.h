// Where a scan was taken, with no idea of it or only a rough one: places that look like it, a
// correlative check, registration, and a decision that says "don't know" rather than a wrong place.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "core/base/status.h"
#include "core/localization/local_map.h"
#include "core/localization/places/place_index.h"
#include "core/localization/registration.h"
#include "core/localization/scan_features.h"
#include "core/scan/leveled_scan.h"

namespace atlas {

struct RelocalizerOptions {
  FeatureOptions features;
  PlaceOptions window;
  RegistrationOptions registration;

  std::size_t candidates = 80;  // places that are checked ...
  double candidates_apart_m = 1.5;
  std::size_t checked_columns = 160;  // ... by so many of the scan's columns ...
  std::size_t refined = 5;            // ... and of which the best so many are registered
  double refined_apart_m = 1.0;
  double refined_apart_rad = 0.1;

  // A place is believed when it fits this well, when this share of the scan's columns stands on
  // structure there and so much of it is explained, when what is seen holds the vehicle in all
  // directions this well, and when any other place explains this much less.
  double min_fit = 0.6;
  double min_columns = 0.3;
  double min_explained = 0.15;
  double max_sigma_m = 0.015;  // of the worst horizontal direction
  double min_margin = 0.04;
};

// A place that was registered.
struct RelocalizedPlace {
  RegistrationResult registration;
  double explained = 0.0;  // share of the scan's columns that the map explains, less contradictions
};

struct Relocalization {
  // None: don't know.
  std::optional<Pose> T_world_sensor;
  std::vector<RelocalizedPlace> places;  // that were registered, the likeliest first
  double margin = 0.0;                   // of the first over the next, in what they explain
};

class Relocalizer {
 public:
  // `places` is finished; `tiles` as for the localizer.
  Relocalizer(const MapProfile& profile,
              std::shared_ptr<const PlaceIndex> places,
              TilesAround tiles,
              const RelocalizerOptions& options = {});

  // `scan` is levelled by `R_level_sensor`. Errors are those of the tiles' source.
  Result<Relocalization> Find(const LeveledScan& scan,
                              const Eigen::Quaterniond& R_level_sensor,
                              const std::optional<PlacePrior>& prior = std::nullopt) const;

 private:
  struct Start {
    Pose T_world_level;
    int score = 0;
  };

  std::vector<Start> Check(const ScanFeatures& features,
                           const std::vector<PlaceCandidate>& candidates,
                           double sensor_height_m) const;
  Result<std::vector<RelocalizedPlace>> Refine(const ScanFeatures& features,
                                               const std::vector<Start>& starts,
                                               double sensor_height_m) const;
  RelocalizedPlace Placed(const MapWindow& window,
                          const ScanFeatures& features,
                          const Pose& start) const;
  void Add(RelocalizedPlace place, std::vector<RelocalizedPlace>& places) const;
  bool IsBelieved(const Relocalization& found) const;
  bool AreApart(const Pose& a, const Pose& b) const;

  MapProfile profile_;
  std::shared_ptr<const PlaceIndex> places_;
  TilesAround tiles_;
  RelocalizerOptions options_;
};

// Height of the ground below the sensor in a levelled scan; none where it shows too little ground.
std::optional<double> GroundBelow(const LeveledScan& scan);

}  // namespace atlas
