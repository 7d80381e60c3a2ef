// How a part of a recorded drive lies in an atlas that it was not recorded with: several scans are
// found in the map, each alone, those that agree are believed, and all others are looked for from
// there. "Don't know" rather than a wrong place.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/drive/anchor/anchor_fit.h"
#include "client/drive/anchor/anchor_guess.h"
#include "client/drive/anchor/frame_fit.h"
#include "client/drive/anchor/position_fit.h"
#include "client/drive/anchor/scan_follower.h"
#include "client/drive/anchor/scan_source.h"
#include "client/drive/drive_survey.h"
#include "client/map/map_view.h"
#include "core/base/status.h"
#include "core/localization/relocalizer.h"
#include "core/scan/drive_folder.h"

namespace atlas {

struct AnchorOptions {
  PlacePrior prior;  // where the drive begins, in the atlas's frame
  // Scans that are looked for in the whole map, evenly spread over the drive, and as many again
  // around those that were found: a drive may be on the map for a small part of its way.
  std::size_t probes = 32;
  double probe_spacing_m = 3.0;  // at least, else they see the same
  double around_m = 12.0;
  // So many have to agree, and so many times as many as were found elsewhere. One scan alone is
  // found in a wrong place once in 500 times in a city, more often where things look alike
  // (docs/results.md); wrong ones do not agree.
  std::size_t min_agreeing = 3;
  std::size_t min_ratio = 3;
  std::size_t enough_agreeing = 8;  // of as many that were found: no other is looked for
  AgreementOptions agreement;
  // From there on the others are followed.
  FollowOptions follow;
  // Places that scans look like, but were not believed: where as many of them agree on another
  // transform, the drive is tracked there, too, and has to fit the map so much less well, as a sum
  // over its scans. A world that looks the same from two sides is found out so: where one of them
  // was mapped less, every scan alone takes the other, but the drive fits both alike (1.0 times),
  // while it fits one deck of a garage 1.6 times as well as the next.
  double min_guess_fit = 0.4;
  std::size_t candidates = 4;
  double min_margin = 1.3;
  // A drive whose own poses are bent more than that is for a merge, not for a transform: live, it
  // would blur the map, or double it. All of it: recorded ones that are well known lie 0.09 m off,
  // odometry that drifts by 1 % and 0.5 degrees in 100 m is 0.23 m and more off after 74 m. And
  // where it is off the most: those lie up to 0.13 m and 0.2 degrees off there, and one of 35
  // scans is lost, at the end of the map.
  FrameLimits limits{.rms_m = 0.12,
                     .rms_rad = 0.25 * std::numbers::pi / 180.0,
                     .worst_rms_m = 0.18,
                     .worst_rms_rad = 0.4 * std::numbers::pi / 180.0,
                     .longest_astray = 1,
                     .found_per_astray = 30};
  // What comes to a session that is there may be the worst part of a drive that was accepted.
  FrameLimits limits_of_rest{.rms_m = 0.21,
                             .rms_rad = 0.45 * std::numbers::pi / 180.0,
                             .worst_rms_m = 0.21,
                             .worst_rms_rad = 0.45 * std::numbers::pi / 180.0,
                             .longest_astray = 1,
                             .found_per_astray = 30};
  // It was looked at by the run that began it, and is not looked at again.
  bool is_rest_accepted = false;
  // Of the scans that were found so many may lie elsewhere by the transform in the end: more are a
  // part of the drive that does.
  std::size_t max_off = 1;

  // kInvalidArgument naming the first option out of range.
  Status Validate() const;
};

struct PartAnchor {
  std::optional<LevelTransform> T_map_drive;  // none: don't know
  std::size_t probed = 0;                     // scans that were looked for in the whole map,
  std::size_t found = 0;                      // that were found,
  std::size_t agreeing = 0;                   // and that agree
  FrameFit fit;                               // of scans along the way
  PositionFit position_fit;                   // of all that have a position
  Eigen::Vector3d begin_m = Eigen::Vector3d::Zero();  // the first scan, in the map, if it is known
  std::string why_not;                                // for people
};

class PartAnchoring {
 public:
  // Reads the whole map; `view` outlives it. kNotFound: the map has no place to be at. Else fails
  // as the view does.
  static Result<PartAnchoring> Create(const DriveSurvey& survey,
                                      const MotionDuringScan& motion,
                                      const KnownPlaces& positions,
                                      MapView& view,
                                      const AnchorOptions& options);

  // The prior is of the part that begins the drive. Scans that have a position are looked for
  // around that, and in the middle they have to lie there. Errors are those of the scans and of the
  // view.
  Result<PartAnchor> Find(PartScans scans, bool is_first_part);
  // How scans that are to lie in the map by `T_map_drive` fit it around where that puts them. Fails
  // as Find().
  Result<FrameFit> Measure(PartScans scans, const LevelTransform& T_map_drive);

 private:
  struct Probes;
  struct Candidate;

  PartAnchoring(const DriveSurvey& survey,
                const ScanSource& source,
                KnownPlaces positions,
                MapView& view,
                std::shared_ptr<const PlaceIndex> places,
                const AnchorOptions& options);

  Status Probe(PartScans scans, std::size_t index, Probes& probes) const;
  Status ProbeAll(PartScans scans, Probes& probes) const;
  bool IsClear(const Probes& probes) const;
  Status Track(PartScans scans, bool is_best, Candidate& candidate);
  bool LiesAtPositions(PartScans scans, const LevelTransform& T_map_drive) const;
  bool IsBelieved(std::size_t agreeing, std::size_t elsewhere) const;
  PlacePrior PriorOfScan(PartScans scans, std::size_t index, const Probes& probes) const;
  void Settle(PartScans scans,
              const std::vector<Candidate>& candidates,
              const Probes& probes,
              PartAnchor& anchor) const;

  ScanSource source_;
  KnownPlaces positions_;
  AnchorOptions options_;
  Relocalizer relocalizer_;
  ScanFollower follower_;
};

// Whether a drive that begins there begins where it is said to, as well as the map tells.
bool BeginsWithin(const Eigen::Vector3d& begin_m,
                  const PlacePrior& prior,
                  const AnchorOptions& options);

}  // namespace atlas
