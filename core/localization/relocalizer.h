// Where a scan was taken, with no idea of it or only a rough one: places that look like it, a
// correlative check, registration, and a decision that says "don't know" rather than a wrong place.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "core/base/status.h"
#include "core/localization/belief/other_decks.h"
#include "core/localization/belief/place_score.h"
#include "core/localization/places/place_index.h"
#include "core/localization/registration/registration.h"
#include "core/localization/registration/scan_features.h"
#include "core/localization/window/local_map.h"
#include "core/scan/leveled_scan.h"

namespace atlas {

struct RelocalizerOptions {
  FeatureOptions features;
  PlaceOptions window;
  RegistrationOptions registration;
  // What was found on a ramp may be a metre above or below the surface that it is on.
  DeckOptions decks{.reach_m = 30.0, .least_m = 0.5, .most = 8};

  std::size_t candidates = 300;  // places that are checked ...
  double candidates_apart_m = 1.5;
  std::size_t checked_columns = 160;  // ... by half of so many of the scan's columns; by all ...
  std::size_t checked_closely = 100;  // ... of which the best so many are checked ...
  std::size_t refined = 5;            // ... and of which the best so many are registered, ...
  double refined_share = 0.5;         // ... if they carry this share of the best one's columns
  double refined_apart_m = 1.0;
  double refined_apart_rad = 0.1;

  // A place is believed when it fits this well, when this share of the scan's columns stands on
  // structure there and so much of it is explained, when what is seen holds the vehicle in all
  // directions this well, and when any other place scores this much less.
  double min_fit = 0.6;
  double min_columns = 0.3;
  double min_explained = 0.15;
  double max_sigma_m = 0.015;  // of the worst horizontal direction
  double min_margin = 0.08;
  // ... where that is a deck above or below: they look alike. The more where a scan of few
  // columns counts less (DeckWeight).
  double min_deck_margin = 0.12;
  double many_columns = kManyColumns;
};

// A place that was registered.
struct RelocalizedPlace {
  RegistrationResult registration;
  double explained = 0.0;  // ExplainedShare
  double score = 0.0;      // PlaceScore
};

struct Relocalization {
  // None: don't know.
  std::optional<Pose> T_world_sensor;
  std::vector<RelocalizedPlace> places;  // that were registered, the one that scores most first
  double margin = 0.0;                   // of the first over the next
};

class Relocalizer {
 public:
  // `places` is finished; `tiles` as for the localizer.
  Relocalizer(const MapProfile& profile,
              std::shared_ptr<const PlaceIndex> places,
              TilesAround tiles,
              const RelocalizerOptions& options = {});

  // `scan` is levelled by `R_level_sensor`. A place that is not at the height of `prior` counts for
  // nothing. Errors are those of the tiles' source.
  Result<Relocalization> Find(const LeveledScan& scan,
                              const Eigen::Quaterniond& R_level_sensor,
                              const std::optional<PlacePrior>& prior = std::nullopt) const;

 private:
  struct Start {
    Pose T_world_level;
    int score = 0;
  };
  static bool HasMore(const Start& a, const Start& b) { return a.score > b.score; }

  std::vector<Start> Check(const ScanFeatures& features,
                           const std::vector<PlaceCandidate>& candidates,
                           double sensor_height_m) const;
  Result<std::vector<RelocalizedPlace>> Refine(const ScanFeatures& features,
                                               const std::vector<Start>& starts,
                                               const std::optional<PlacePrior>& prior) const;
  RelocalizedPlace Placed(const MapWindow& window,
                          const ScanFeatures& features,
                          const Pose& start) const;
  void Add(RelocalizedPlace place, std::vector<RelocalizedPlace>& places) const;
  bool IsBelieved(const Relocalization& found, double deck_weight) const;
  // Whether that much more speaks for `best`.
  bool IsBehind(const RelocalizedPlace& other,
                const RelocalizedPlace& best,
                double deck_weight) const;

  MapProfile profile_;
  std::shared_ptr<const PlaceIndex> places_;
  TilesAround tiles_;
  RelocalizerOptions options_;
};

// Height of the ground below the sensor in a levelled scan; none where it shows too little ground.
std::optional<double> GroundBelow(const LeveledScan& scan);

}  // namespace atlas
