// Where the vehicle is: it is tracked (place_tracker), and when it is lost or in doubt it is looked
// for in the whole map (relocalizer). What looks alike there is tracked side by side, until the
// scans of a short drive tell which of the places it is.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "core/base/status.h"
#include "core/localization/belief/localization_result.h"
#include "core/localization/odometry/own_motion.h"
#include "core/localization/registration/pose_prior.h"
#include "core/localization/registration/scan_features.h"
#include "core/localization/relocalizer.h"
#include "core/localization/tracking/place_tracker.h"
#include "core/localization/window/local_map.h"
#include "core/scan/leveled_scan.h"

namespace atlas {

struct LocalizerOptions {
  FeatureOptions features;
  PlaceTrackerOptions tracker;

  // Whose features, or whose scan, reach no further than this is weak at best: decks and straight
  // roads look alike then. Of two simulated drives 40 of 216 scans (10 m) and 34 of 242 (15 m)
  // fitted well where they were not, from 20 m on none.
  double min_good_reach_m = 20.0;

  // Lost or in doubt for so many scans, or adrift this far, it is looked for in the whole map, and
  // again after so many more.
  int looked_after = 3;
  int looked_again_after = 5;
  double adrift_m = 8.0;

  // Tracked are so many places that scored `min_found_score` when they were found, apart from where
  // others are expected, and that score less than another by `max_behind` at most. Right ones,
  // found in garages and on an overpass, score 0.6 at least and 0.66 but for one in twenty; those
  // of maps of other places 0.62 at most, over several scans.
  std::size_t most_places = 8;
  std::size_t most_scores = 100;  // of the last scans
  double min_found_score = 0.55;
  double same_m = 2.0;
  double same_rad = 0.3;
  double max_behind = 0.3;
  int most_lost = 1;  // scans in a row; a place that has more is given up
  // Believed is one that is confirmed, scores this much on average, and has such a lead over any
  // other.
  double min_score = 0.65;
  LeadOptions lead;
};

// Made when it is first needed; null: there is none.
using RelocalizerSource = std::function<Result<std::shared_ptr<const Relocalizer>>()>;

class Localizer {
 public:
  // `relocalizer` may be empty: a vehicle that is lost is then looked for around where it should
  // be.
  Localizer(const MapProfile& profile,
            TilesAround tiles,
            const LocalizerOptions& options,
            RelocalizerSource relocalizer = {});

  // Forgets the motion; the next scan is near `T_world_sensor`. A covariance is believed: no place
  // counts that is further than 3.5 standard deviations from it in the plane, or three in height,
  // and where the map has none so near, the vehicle goes on from there by its own motion, lost,
  // until it has. A hint is not. Either way, a place that fits as well so near makes the first scan
  // weak: bays and posts repeat.
  void Start(const Pose& T_world_sensor, const StartKnowledge& known = StartHint());

  // How the sensor is taken to move from one scan to the next, in its own frame: what scans are to
  // be deskewed by. Identity as long as nothing is known of it.
  Pose T_now_later() const { return places_.front().tracker.T_now_later(); }
  // How uncertain that is: of (x, y, z, yaw), along the world's axes.
  PoseCovariance MotionCovariance() const { return places_.front().tracker.MotionCovariance(); }

  // Requires Start(). `scan` is levelled by `R_level_sensor` and comes `scans` times the usual time
  // after the last one: some may be missing (ScanClock). Errors are those of the tiles' and the
  // relocalizer's sources; the scan counts for nothing then.
  Result<LocalizationResult> Localize(const LeveledScan& scan,
                                      const Eigen::Quaterniond& R_level_sensor,
                                      double scans = 1.0);
  // Of a scan that was deskewed by T_now_later() over `revolutions`, of which the sensor makes so
  // many from one scan to the next: `scan` is deskewed again by the motion that it shows, as often
  // as it fits the better so.
  Result<LocalizationResult> LocalizeDeskewed(LeveledScan& scan,
                                              const Eigen::Quaterniond& R_level_sensor,
                                              double scans,
                                              double revolutions);

 private:
  // Where it may be.
  struct SupposedPlace {
    explicit SupposedPlace(PlaceTracker at) : tracker(std::move(at)) {}

    PlaceTracker tracker;
    int number = 0;                             // of all places that were supposed
    LocalizationResult result;                  // of the last scan
    std::vector<double> scores;                 // of the scans since others are supposed, too
    std::vector<std::optional<float>> weights;  // of the last scan's columns there
    bool is_at_edge = false;                    // of the map, at the last scan
    int lost = 0;                               // scans in a row
  };

  PlaceTracker NewTracker() const;
  Status Expect(const LeveledScan& scan, const Eigen::Quaterniond& R_level_sensor, double scans);
  void Sharpen(LeveledScan& scan, const Eigen::Quaterniond& R_level_sensor, double revolutions);
  LocalizationResult Find(const LeveledScan& scan, const Eigen::Quaterniond& R_level_sensor);
  bool IsLookedFor() const;
  // Places in the whole map where the scan may have been taken.
  Result<std::vector<SupposedPlace>> Look(const LeveledScan& scan,
                                          const Eigen::Quaterniond& R_level_sensor) const;
  bool IsFollowed(const Pose& T_world_sensor) const;
  void Follow(const ScanFeatures& features, const Eigen::Quaterniond& R_level_sensor);
  // What the scan says of each place, and of each over each other.
  void Note(const ScanFeatures& features);
  // The vehicle's step from the last scan, where a place that is not known needs it.
  std::optional<OwnStep> StepOf(const ScanFeatures& features);
  // Of two that came to the same place one stays.
  void Join();
  bool IsBetter(const SupposedPlace& a, const SupposedPlace& b) const;
  // Those that are lost, far behind, or too many.
  void GiveUp();
  bool IsGivenUp(const SupposedPlace& place) const;
  // How much more a place scores than another, of scans that both have: sums by all that the map
  // knows of either and, where both fit, by what it knows of both. What was mapped better explains
  // more, wherever the vehicle is: where the map ends at the other one, and where the vehicle is
  // known to be at the other one, it has to be ahead by both.
  struct Lead {
    double by_all = 0.0;
    double by_common = 0.0;
    int scans = 0;

    double by_both() const { return std::min(by_all, by_common); }
  };
  bool IsThere(const std::pair<int, int>& numbers) const;  // both
  Lead LeadOver(const SupposedPlace& place, const SupposedPlace& other) const;
  double SumOf(const Lead& lead, const SupposedPlace& other) const;
  bool IsBelieved(const SupposedPlace& place) const;
  bool IsAhead(const SupposedPlace& place) const;
  // The first of the places is then the one that is believed, if any is.
  void Choose();

  MapProfile profile_;
  TilesAround tiles_;
  LocalizerOptions options_;
  FeatureExtractor features_;
  LeveledScan deskewed_;  // kept for its memory
  RelocalizerSource relocalizer_;
  // The first is the one that is told of: where it was tracked to. Others are while it is astray.
  std::vector<SupposedPlace> places_;
  std::map<std::pair<int, int>, Lead> leads_;  // by the places' numbers
  int supposed_ = 0;                           // places so far
  int astray_ = 0;        // scans in a row in which it was lost, in doubt, or adrift too far
  OwnMotion own_motion_;  // while it is
  double scans_ = 0.0;    // that were expected since the last one was followed
};

}  // namespace atlas
