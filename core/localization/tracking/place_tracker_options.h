// What a place is tracked by (place_tracker): thresholds by what they are asked for.
#pragma once

#include <cstddef>
#include <numbers>

#include "core/localization/belief/confirmation.h"
#include "core/localization/belief/seen_information.h"
#include "core/localization/odometry/motion_model.h"
#include "core/localization/odometry/scan_trail.h"
#include "core/localization/registration/pose_search.h"
#include "core/localization/registration/registration.h"
#include "core/localization/tracking/place_drift.h"
#include "core/localization/tracking/place_hypotheses.h"
#include "core/localization/window/local_map.h"

namespace atlas {

// How far an answer can be believed.
struct HealthOptions {
  // Of RegistrationResult; less is lost. Wrong places on real drives, found from starts up to 6 m
  // and 20 degrees off, fit 0.385 at most, right ones 0.48 and more but for two in a hundred.
  double min_fit = 0.4;
  double good_fit = 0.45;  // less is weak
  // A scan with so many columns of which fewer than this share stand on structure is weak: ground
  // alone is much the same everywhere. On whole drives right places had 0.11 at least, but for one
  // in a map that has little of what it sees; 40 m off, on a bridge instead of below it, 0.02.
  // After more such scans in a row its covariance is that of an unknown place.
  double min_columns = 0.05;
  std::size_t few_columns = 30;
  int most_unheld = 2;
  double max_weak_sigma_m = 0.10;  // of the worst horizontal direction; more is weak,
  double max_weak_up_m = 0.3;      // as is a height that is known no better, standard deviation
  int told_lost_after = 5;  // scans, from which on its covariance is that of an unknown place
};

// A start that is known to some metres.
struct StartOptions {
  // A first scan has to be confirmed where it is found further than this beyond what is told of the
  // start.
  double beyond_m = 0.5;
  double beyond_rad = 0.05;
  double up_m = 1.0;  // in height, whatever is told
  // It is looked for no further off than this: with any heading that takes seconds. Who is further
  // off is lost, and for a relocalizer.
  double max_m = 10.0;
  // One whose height is not sure is tried on surfaces so far from each other.
  double told_step_m = 0.4;
};

// A place that is less and less certain along some direction.
struct AdriftOptions {
  // Where it is less certain than this, starts are tried along the least certain direction, two
  // sigmas either way ...
  double fan_sigma_m = 0.4;
  double fan_step_m = 0.5;
  // ... up to here. From here on the vehicle is adrift: it is looked for in two sigmas along and
  // across that direction and in these headings, by more of the scan and with more candidates.
  double sigma_m = 2.5;
  double max_m = 80.0;
  double max_beside_m = 4.0;
  double yaw_rad = 0.15;
  std::size_t columns = 128;
  std::size_t candidates = 16;
};

// A vehicle that may not be where it was tracked to.
struct DoubtOptions {
  // A fit below this share of the usual one, or this fit of columns: the vehicle may have turned or
  // braked more than predicted, so other places and headings are tried, further off with every scan
  // that is lost.
  double fit = 0.85;
  double column_fit = 0.3;
  SearchReach search_reach;  // of the first search; each lost scan adds as much
  SearchReach max_search_reach{8.0, 8.0, std::numbers::pi};
  // So far beside a place that was found another one has to fit less before it is known.
  SearchReach beside{8.0, 8.0, 0.1};
  int max_coasting = 10;       // scans that a lost vehicle is taken to go on as it did,
  int looked_again_after = 5;  // from then on it is looked for around there as often
};

// Whoever was found where nobody expected him has to be confirmed.
struct SurpriseOptions {
  // Found where the prior's log density is below this, the vehicle moved as nobody expected.
  double log_density = -8.0;
  // ... and it is nowhere near if it is further than this from where it was expected.
  double near_m = 3.0;
  double near_rad = 1.2;
  int long_known = 20;  // good scans, from which on where it is and how it moves is believed
};

// A vehicle that leaves the map, or drives along where that ends (map_edge).
struct EdgeOptions {
  // Where less than this share of the ground around was mapped at its height, a vehicle that is
  // known goes on by its own motion when the scan does not fit: what else is near in the map is
  // another deck, or looks like it. Less than the second does not keep it on the map where the scan
  // fits well enough.
  double min_ground_mapped = 0.5;
  double least_ground_mapped = 0.25;
  // Where less than this share is, weak places are checked by that motion, which is to agree.
  double edge_ground_mapped = 0.9;
  // Until that motion has a break in it, no place counts that is further than so many standard
  // deviations from where it came to: of (x, y, yaw) in all, and of the height: 0.997 of what a
  // covariance says. A deck is no further than that is.
  double reachable_sigmas = 3.5;
  double reachable_up_sigmas = 3.0;
};

struct PlaceTrackerOptions {
  LocalMapOptions map;
  RegistrationOptions registration;
  MotionOptions motion;
  PauseOptions pause;
  PoseSearchOptions search;
  HypothesisOptions hypotheses;
  ConfirmationOptions confirmation;
  ScanTrailOptions trail;
  PlaceDriftOptions drift;
  SeenOptions seen;
  HealthOptions health;
  StartOptions start;
  AdriftOptions adrift;
  DoubtOptions doubt;
  SurpriseOptions surprise;
  EdgeOptions edge;

  // Where the map is not all there, it is asked for again after so many scans, at a standstill,
  // too.
  int asked_again_after = 5;
};

}  // namespace atlas
