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
#include "client/drive/drive_survey.h"
#include "client/drive/scan_localizer.h"
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
  // From there on scans are tracked, with the drive's poses for the motion.
  double track_spacing_m = 1.0;
  // A scan that is farther from where it is expected contradicts.
  double max_surprise_m = 0.5;
  double max_surprise_rad = 2.0 * std::numbers::pi / 180.0;
  // Places that scans look like, but were not believed: where as many of them agree on another
  // transform, the drive is tracked there, too, and has to fit the map so much less well, as a sum
  // over its scans. A world that looks the same from two sides is found out so: where one of them
  // was mapped less, every scan alone takes the other, but the drive fits both alike (1.0 times),
  // while it fits one deck of a garage 1.6 times as well as the next.
  double min_guess_fit = 0.4;
  std::size_t candidates = 4;
  double min_margin = 1.3;
  // A drive whose own poses are bent more than that is for a merge, not for a transform: live, it
  // would blur the map. Recorded ones that are well known lie 0.09 m off, odometry that drifts by
  // 1 % and 0.5 degrees in 100 m is 0.23 m and more off after 74 m.
  double max_rms_m = 0.12;

  // kInvalidArgument naming the first option out of range.
  Status Validate() const;
};

struct PartAnchor {
  std::optional<LevelTransform> T_map_drive;  // none: don't know
  std::size_t probed = 0;                     // scans that were looked for in the whole map,
  std::size_t found = 0;                      // that were found,
  std::size_t agreeing = 0;                   // and that agree
  std::size_t tracked = 0;                    // scans that the transform was fitted to,
  std::size_t contradicting = 0;              // and that lie elsewhere
  double rms_m = 0.0;                         // of the tracked ones from the transform
  double rms_yaw_rad = 0.0;
  Eigen::Vector3d begin_m = Eigen::Vector3d::Zero();  // the first scan, in the map, if it is known
  std::string why_not;                                // for people
};

class PartAnchoring {
 public:
  // Reads the whole map; `view` outlives it. kNotFound: the map has no place to be at. Else fails
  // as the view does.
  static Result<PartAnchoring> Create(const DriveSurvey& survey,
                                      MapView& view,
                                      const AnchorOptions& options);

  // Of one part, in their order, not empty.
  using Scans = std::span<const DriveScan* const>;
  // The prior is of the part that begins the drive. Errors are those of the scans and of the view.
  Result<PartAnchor> Find(Scans scans, bool is_first_part);
  // Of scans that are to lie in the map by `T_map_drive`, in their order: how many of them fit it
  // around where that puts them, and how far off there, RMS; and how many do not, although that
  // place is mapped. Fails as Find().
  struct Misfit {
    std::size_t tracked = 0;
    std::size_t astray = 0;
    double rms_m = 0.0;
  };
  Result<Misfit> Measure(Scans scans, const LevelTransform& T_map_drive);

 private:
  struct Probes;
  struct Candidate;

  PartAnchoring(const DriveSurvey& survey,
                MapView& view,
                std::shared_ptr<const PlaceIndex> places,
                const AnchorOptions& options);

  Status Probe(Scans scans, std::size_t index, Probes& probes) const;
  Status ProbeAll(Scans scans, const std::vector<double>& way_m, Probes& probes) const;
  bool IsClear(const Probes& probes) const;
  Status Track(Scans scans, const std::vector<double>& way_m, Candidate& candidate);
  Status Follow(Scans scans,
                const std::vector<double>& way_m,
                const std::vector<std::size_t>& order,
                const Pose& T_map_drive,
                Candidate& candidate);
  Result<LocatedScan> LocateNear(const DriveScan& scan, const Pose& T_map_sensor);
  Result<bool> IsMapped(const Pose& T_map_sensor) const;
  bool IsBelieved(std::size_t agreeing, std::size_t elsewhere) const;
  // `first`: the first scan in the drive; `prior`: of where it is in the map.
  void Settle(const std::vector<Candidate>& candidates,
              const Pose& first,
              const PlacePrior& prior,
              PartAnchor& anchor) const;

  DriveSurvey survey_;
  MapView* view_;
  AnchorOptions options_;
  Relocalizer relocalizer_;
  std::unique_ptr<ScanLocalizer> localizer_;
};

// Whether a drive that begins there begins where it is said to, as well as the map tells.
bool BeginsWithin(const Eigen::Vector3d& begin_m,
                  const PlacePrior& prior,
                  const AnchorOptions& options);

}  // namespace atlas
