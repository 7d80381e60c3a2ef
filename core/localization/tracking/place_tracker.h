// A vehicle that is taken to be at one place: keeps a map window around it, predicts its motion,
// matches each scan and says how far the answer can be believed. It looks no further than the
// vehicle may have come.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "core/base/status.h"
#include "core/localization/belief/confirmation.h"
#include "core/localization/belief/localization_result.h"
#include "core/localization/belief/map_edge.h"
#include "core/localization/odometry/motion_model.h"
#include "core/localization/odometry/own_motion.h"
#include "core/localization/odometry/scan_odometry.h"
#include "core/localization/odometry/scan_trail.h"
#include "core/localization/places/place_index.h"
#include "core/localization/registration/pose_search.h"
#include "core/localization/registration/registration.h"
#include "core/localization/registration/scan_features.h"
#include "core/localization/tracking/place_drift.h"
#include "core/localization/tracking/place_hypotheses.h"
#include "core/localization/tracking/place_tracker_options.h"
#include "core/localization/window/local_map.h"

namespace atlas {

class PlaceTracker {
 public:
  // `max_range_m`: of the features that scans are matched by.
  PlaceTracker(const MapProfile& profile,
               TilesAround tiles,
               const PlaceTrackerOptions& options,
               double max_range_m);

  // Forgets the motion; the next scan is near `T_world_sensor`: known to be there, so well, or
  // supposed, until scans confirm it by fitting as those before did (`usual_fit`; 0 where none
  // did).
  void Start(const Pose& T_world_sensor, const StartKnowledge& known);
  void Suppose(const Pose& T_world_sensor, double usual_fit);

  // How the sensor is taken to move from one scan to the next, in its own frame. Identity as long
  // as nothing is known of it.
  Pose T_now_later() const { return motion_.T_now_later(); }
  PoseCovariance MotionCovariance() const { return motion_.MotionCovariance(); }

  // The next scan comes after so many times the usual time between two, and after those that were
  // expected and not tracked, for want of a map. Before all that asks for it.
  void Expect(double scans) {
    untracked_ += scans;
    scans_ = untracked_;
  }
  // Where the next scan is expected.
  Pose T_world_expected() const { return Next().T_world_sensor(); }

  // Has the map that the next scan needs. Errors are those of the tiles' source; nothing has
  // changed then.
  Status Prepare();
  // As the scan at hand shows it, found near where it is expected, T_now_later(); none, where
  // nothing was known before or it is not found. Requires what Track() does, and changes nothing.
  struct SeenMotion {
    Pose T_now_later = Pose::Identity();
    double fit = 0.0;
  };
  std::optional<SeenMotion> MotionSeen(const ScanFeatures& scan);
  // Requires Start() or Suppose(), and Prepare() for each scan. `features` are those of a scan
  // levelled by `R_level_sensor`. `step`: the vehicle's own, from the last scan, where somebody
  // looked; a place that is not confirmed goes along with it.
  LocalizationResult Track(const ScanFeatures& features,
                           const Eigen::Quaterniond& R_level_sensor,
                           const std::optional<OwnStep>& step);

  // Whether it is known that the vehicle is where it is tracked
  // (core/localization/belief/confirmation).
  bool is_confirmed() const { return confirmation_.is_confirmed(); }
  // The last answer, when another place may be the right one as well.
  LocalizationResult Doubted(LocalizationResult result) const;
  double usual_fit() const { return usual_fit_; }
  // Whether it was tracked there from scan to scan since it was told or settled, however the scans
  // fitted: else it was found.
  bool is_tracked_on() const { return !is_elsewhere_; }
  void Settle() { is_elsewhere_ = was_anywhere_ = false; }
  // Whether it was found of late, where nobody expected it: elsewhere in the map it may fit as
  // well.
  bool is_just_found() const { return was_anywhere_; }
  // Whether the map ends where a scan was taken.
  bool IsAtEdge(const ScanFeatures& features, const Pose& T_world_level) const {
    return atlas::IsAtEdge(map_.window(), features, T_world_level);
  }
  // FeatureFit::ColumnWeights(), in the map around it.
  void ColumnWeights(const ScanFeatures& features,
                     const Pose& T_world_level,
                     std::vector<std::optional<float>>& weights) const;
  // Whether it goes along with the vehicle's own motion to the next scan: it is where scans fit,
  // and either nothing says yet that it is not another place, or it is badly known where the next
  // one will be.
  bool GoesAlong() const;
  // Whether it went off the map and is carried on by its own motion from where it was known.
  bool is_carried() const { return carried_ > 0; }
  // Whether it can be there by now; everywhere, where it is not carried.
  bool IsReachable(const Pose& T_world_sensor) const;
  // How far from where it is expected that is, in the direction in which that is least known.
  double reach_m() const { return options_.edge.reachable_sigmas * spread_m(); }
  // The same around where the next scan is expected; nothing where it is not carried.
  std::optional<PlacePrior> Within() const;
  // How uncertain its place is in the direction in which it is least known, standard deviation.
  double spread_m() const { return SpreadOf(motion_.covariance()).along_m; }

 private:
  // Where a scan was tracked to.
  struct Tracked {
    PlaceHypothesis place;
    std::optional<Eigen::Vector2d> rival;  // RivalOf()
  };
  // Near there, or elsewhere, where that is in doubt.
  struct Located {
    RegistrationResult registration;
    std::optional<Eigen::Vector2d> rival;
    bool is_found = false;  // elsewhere
  };
  // Places around where the scan was expected.
  struct Searched {
    std::optional<RegistrationResult> found;  // likelier than what was tracked, and than all others
    std::optional<Eigen::Vector2d> rival;     // as likely as what was tracked, from there
  };
  // After one of the intervals that may have passed.
  struct Arrival {
    MotionModel motion;
    Pose T_world_level = Pose::Identity();  // where the scan fits
    double log_likelihood = 0.0;            // of the scan there
    double log_expected = 0.0;              // of that place
    double log_odds = 0.0;                  // of that interval
  };
  // Whether a place is where a vehicle that was known to be somewhere can be now.
  enum class Surprise : std::uint8_t {
    kNone,
    kOdd,  // near where it was expected, but the scan does not fit as usual
    kNew,
  };

  MotionModel Next() const;  // at the next scan
  static PosePrior PriorOf(const MotionModel& motion);
  PosePrior Prior() const { return PriorOf(motion_); }
  PlaceHypothesis At(const RegistrationResult& registration, bool has_prior) const;
  // Fills starts_ with what is tried first: the prediction, and others where it is uncertain.
  void SpreadStarts(const PosePrior& prior);
  // ... and where the ground that is seen would lie on what was mapped, for a start that was told.
  void RaiseStarts(const PosePrior& prior, const ScanFeatures& features);
  Tracked Follow(const ScanFeatures& features);
  Located Locate(const ScanFeatures& features, Tracked tracked);
  void Remember(const LocalizationResult& result, const Eigen::Matrix4d& seen, bool is_found);
  void NoteCover(MapCover cover);

  // place_tracker_start: whether a start is so vague that other places in it count.
  bool IsVagueStart() const;
  SearchReach StartReach() const;
  bool IsWithinStart(const Pose& T_world_level) const;

  // place_tracker_interval: at the scan at hand, after as long as is told, or a whole number of
  // usual intervals.
  MotionModel Arrived(const ScanFeatures& features);
  std::array<double, 2> WholeIntervals() const;
  MotionModel After(double scans) const;
  // Where the scan fits near where `motion`, over so many intervals, leads.
  Arrival ArrivalBy(const MotionModel& motion, double scans, const ScanFeatures& features) const;
  // Up to constants: that it was so long, where another time is told; that a vehicle is found
  // there.
  double LogOddsOf(double scans) const;
  double LogExpected(const Pose& expected, const Pose& found) const;
  bool IsLikelier(const Arrival& a, const Arrival& b) const;
  bool IsSpeedKnown() const;
  // Where it was found elsewhere than expected: after the interval that explains it best.
  void ArriveAt(const Pose& T_world_level, const MotionModel& before);
  // Whether the scan says that the vehicle stood since the last one; then that is its motion.
  bool HasStood(const ScanFeatures& features);
  // How well it fits near where that motion led: to the map, none where it does not fit as usual;
  // and to the scans before it, which is asked off the map and where that ends.
  std::optional<double> LikelihoodNear(const MotionModel& model,
                                       const ScanFeatures& features) const;
  std::optional<double> FitOnTrail(const MotionModel& model, const ScanFeatures& features) const;

  // place_tracker_search
  bool IsDoubtful(const RegistrationResult& result) const;
  bool IsAdrift() const;
  double AdriftReach(const PoseCovariance& covariance) const;
  SearchReach Reach(bool is_doubtful) const;
  Searched Search(const ScanFeatures& features, const RegistrationResult& tracked);

  // place_tracker_carry: goes off the map, if that is where it drove, or where it was told to be.
  bool LeavesMap(const RegistrationResult& tracked, const ScanFeatures& features);
  // By what the last scans saw, where there are any and this one goes with them.
  bool CarryOn(const ScanFeatures& features);
  // To where its own scans say.
  void Go(const ScanMotion& moved);
  // The scan, for those that follow, where it is known where it was taken.
  void Keep(const ScanFeatures& features, const LocalizationResult& result, bool is_found);
  // Whether little of the map is left to hold it, and its own motion brought it there, too.
  bool IsNearEdge(const ScanFeatures& features, const LocalizationResult& result);
  // Whether so much of the ground is mapped that the scan would fit if this were the place.
  bool IsOnMap(const RegistrationResult& result,
               const ScanFeatures& features,
               double unknown_share) const;
  // Whether that is near enough to where it is expected.
  bool IsWithinReach(const Pose& T_world_level) const;
  // On the map again.
  bool IsBack(const RegistrationResult& result, const ScanFeatures& features) const;

  // place_tracker_straying: where the map ends, or the scan is not where and as it was expected,
  // whether the place went elsewhere than the vehicle, as its scans tell. Where the map ends, and
  // where it was known for long, the vehicle is where their motion leads then, in the first case
  // carried on from there; else the place is in doubt. Scans that do not fit to each other mean
  // that it may be anywhere.
  bool Strays(const RegistrationResult& found, const ScanFeatures& features);
  // Whether it is not where the motion before led, where that is known.
  bool IsUnexpected(const RegistrationResult& found) const;
  // PlaceDrift::MovesAlong(), or StaysOff(). At the first scan it does.
  bool MovesAsSeen(const ScanFeatures& features, const RegistrationResult& result);
  // Whether it is known which step that was.
  bool Tells(const OwnStep& step) const;
  void GoAlong(const OwnStep& step);
  // Where `step` leads from the last scan.
  Pose LedBy(const OwnStep& step) const;
  // Whether the last scans that were kept say that this one was taken where it is expected.
  bool GoesWithRecent(const ScanFeatures& features, const PosePrior& expected) const;

  // place_tracker_health
  Surprise SurpriseOf(const RegistrationResult& result,
                      const ScanFeatures& features,
                      bool is_found) const;
  // Takes the place up, which may be a new one, or another deck's.
  void Confirm(const ScanFeatures& features,
               Surprise surprise,
               bool is_found,
               LocalizationResult& result);
  // Whether a place beside it fits as well.
  bool RepeatsBeside(const RegistrationResult& found, const ScanFeatures& features);
  bool IsHeld(const RegistrationResult& result, const ScanFeatures& features) const;
  LocalizationHealth Judge(const RegistrationResult& result,
                           const ScanFeatures& features,
                           Surprise surprise) const;
  PoseCovariance Covariance(const LocalizationResult& result) const;

  PlaceTrackerOptions options_;
  double max_range_m_;
  double cell_size_m_;
  LocalMap map_;
  MotionModel motion_;
  Confirmation confirmation_;
  ScanTrail trail_;  // while it is known where each was taken
  PlaceDrift drift_;
  bool is_first_ = true;
  bool is_told_ = false;       // where it is at the first scan, and how surely
  StartHint hint_;             // where it is not
  bool is_elsewhere_ = false;  // it was found, and is not known to be there
  bool was_anywhere_ = false;  // when it was found, and is not known for long
  double scans_ = 1.0;         // from the last scan to the next
  double untracked_ = 0.0;     // of these, expected so far
  double usual_fit_ = 0.0;     // of good results, exponentially forgotten
  // Scans in a row: ...
  int lost_ = 0;
  int known_ = 0;        // that were good
  int unheld_ = 0;       // IsHeld()
  int without_map_ = 0;  // on which the map was not all there
  int carried_ = 0;      // the one at hand as well
  struct AtHand {
    bool has_paused = false;          // before the scan at hand,
    bool has_stood = false;           // meanwhile
    bool has_broken = false;          // its motion
    bool has_strayed = false;         // from its motion, on the map
    std::optional<OwnStep> own_step;  // to it, from elsewhere
  };
  AtHand at_hand_;
  // Of the scan at hand, too; kept for their memory.
  std::vector<Pose> starts_;
  std::vector<PlaceHypothesis> places_;
  ScanFeatures thinned_;
};

}  // namespace atlas
