// A vehicle that is taken to be at one place: keeps a map window around it, predicts its motion,
// matches each scan and says how far the answer can be believed. It looks no further than the
// vehicle may have come.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "core/base/status.h"
#include "core/localization/confirmation.h"
#include "core/localization/local_map.h"
#include "core/localization/localization_result.h"
#include "core/localization/map_edge.h"
#include "core/localization/motion_model.h"
#include "core/localization/odometry/scan_odometry.h"
#include "core/localization/odometry/scan_trail.h"
#include "core/localization/own_motion.h"
#include "core/localization/places/place_index.h"
#include "core/localization/pose_search.h"
#include "core/localization/registration.h"
#include "core/localization/scan_features.h"

namespace atlas {

struct PlaceTrackerOptions {
  LocalMapOptions map;
  RegistrationOptions registration;
  MotionOptions motion;
  PoseSearchOptions search;
  ConfirmationOptions confirmation;
  ScanTrailOptions trail;

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
  int max_coasting = 10;           // scans that a lost vehicle is taken to go on as it did,
  int looked_again_after = 5;      // from then on it is looked for around there as often

  // Where more than so many scans are missing the vehicle may have stood meanwhile (a recorder that
  // waits at a red light with it), where more than that nothing is known of its motion.
  double most_missing = 5.0;
  double most_predicted = 20.0;

  // Neighbouring features err together: a scan informs as this share of its features would, and a
  // feature counts as much in a log likelihood. However many there are, no place is known better
  // than the map is: standard deviations, of a place also as a share of a cell. Fitted to the
  // errors of single shots with 16 and 64 rings and along a simulated drive.
  double information_share = 0.08;
  double map_sigma_m = 0.01;
  double map_sigma_cells = 0.04;
  double coarse_sigma_cells = 0.4;  // a coarse cell stands where any of its fine ones does
  double map_sigma_rad = 0.0006;
  double evidence_share = 0.2;

  // Where the place is less certain than this, starts are tried along the least certain direction,
  // two sigmas either way ...
  double fan_sigma_m = 0.4;
  double fan_step_m = 0.5;
  // ... up to here. From here on the vehicle is adrift: it is looked for in two sigmas along and
  // across that direction and in these headings, by more of the scan and with more candidates.
  double adrift_sigma_m = 2.5;
  double max_adrift_m = 80.0;
  double max_adrift_beside_m = 4.0;
  double adrift_yaw_rad = 0.15;
  std::size_t adrift_columns = 128;
  std::size_t adrift_candidates = 16;

  // A fit below this share of the usual one, or this fit of columns: the vehicle may have turned or
  // braked more than predicted, so other places and headings are tried, further off with every scan
  // that is lost. One is believed when it is this much likelier than where the vehicle was tracked
  // to, and than any other place.
  double doubtful_fit = 0.85;
  double doubtful_column_fit = 0.3;
  double believed_log_ratio = 2.0;
  double unique_log_ratio = 1.0;
  SearchReach search_reach;  // of the first search; each lost scan adds as much
  SearchReach max_search_reach{8.0, 8.0, std::numbers::pi};
  // So far beside a place that was found another one has to fit less before it is known.
  SearchReach beside{8.0, 8.0, 0.1};

  // Where the map is not all there, it is asked for again after so many scans, at a standstill,
  // too.
  int asked_again_after = 5;

  // Where less than this share of the ground around was mapped at its height (map_edge), a
  // vehicle that is known goes on by its own motion when the scan does not fit: what else is near
  // in the map is another deck, or looks like it. Until that motion has a break in it, no place
  // counts that is further than so many standard deviations from where it came to.
  double min_ground_mapped = 0.5;
  // Where less than this share is, weak places are checked by that motion, which is to agree.
  double edge_ground_mapped = 0.9;
  // Where the map ends (map_edge) a place goes where the vehicle does: where it came further than
  // so from where its own motion leads, in all, the vehicle left the map. Where all is well places
  // stray by 0.01 to 0.05 m a scan, where what is left of the map repeats itself by 0.2 to 1 m.
  // So it has to where it is so far from where it was expected: a vehicle brakes by less a scan.
  double unexpected_m = 0.15;
  int long_known = 20;  // good scans, from which on its motion is believed
  double strayed_m = 0.3;
  double strayed_rad = 0.05;
  double straying_kept = 0.9;  // from scan to scan: own motion errs, too
  double same_step_m = 0.5;
  double same_step_rad = 0.05;
  // So far around where a place that is not confirmed has come to its own motion is looked for.
  double unsure_m = 1.0;
  double reachable_sigmas = 3.5;     // of (x, y, yaw) in all, and of the height: 0.997 of what
  double reachable_up_sigmas = 3.0;  // a covariance says. A deck is no further than that is.
  // ... nor does less of the ground keep it on the map where the scan fits well enough.
  double least_ground_mapped = 0.25;

  int told_lost_after = 5;  // scans, from which on its covariance is that of an unknown place

  // Found where the prior's log density is below this, the vehicle moved as nobody expected.
  double surprising_log_density = -8.0;
  // ... and if that is further than this from where it was expected, or it was lost before, it has
  // to be confirmed.
  double expected_m = 3.0;
  double expected_rad = 1.2;
  // A first scan has to be confirmed where it is found further than this beyond what is told of the
  // start.
  double beyond_start_m = 0.5;
  double beyond_start_rad = 0.05;
  double start_up_m = 1.0;  // in height, whatever is told
  // A start is looked for no further off than this: with any heading that takes seconds. Who is
  // further off is lost, and for a relocalizer.
  double max_start_m = 10.0;
  // One whose height is not sure is tried on surfaces so far from each other.
  double told_step_m = 0.4;
};

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

  // Whether it is known that the vehicle is where it is tracked (core/localization/confirmation).
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
  double reach_m() const { return options_.reachable_sigmas * spread_m(); }
  // The same around where the next scan is expected; nothing where it is not carried.
  std::optional<PlacePrior> Within() const;
  // How uncertain its place is in the direction in which it is least known, standard deviation.
  double spread_m() const { return SpreadOf(motion_.covariance()).along_m; }

 private:
  // An answer, and how likely it is, up to a constant.
  struct Place {
    RegistrationResult registration;
    double log_likelihood = 0.0;
  };
  static bool IsLessLikely(const Place& a, const Place& b) {
    return a.log_likelihood < b.log_likelihood;
  }
  struct Tracked {
    Place place;
    // From there to another place that is about as likely: the vehicle may have moved on by one of
    // a row of posts.
    std::optional<Eigen::Vector2d> rival;
  };

  MotionModel Next() const;  // at the next scan
  // Whether the scan says that the vehicle stood since the last one; then that is its motion.
  bool HasStood(const ScanFeatures& features);
  // How well it fits near where that motion led: to the map, none where it does not fit as usual;
  // and to the scans before it, which is asked off the map and where that ends.
  std::optional<double> LikelihoodNear(const MotionModel& model,
                                       const ScanFeatures& features) const;
  std::optional<double> FitOnTrail(const MotionModel& model, const ScanFeatures& features) const;
  static PosePrior PriorOf(const MotionModel& motion);
  PosePrior Prior() const { return PriorOf(motion_); }
  // Where `step` leads from the last scan.
  Pose LedBy(const OwnStep& step) const;
  void GoAlong(const OwnStep& step);
  // Whether it is known which step that was.
  bool Tells(const OwnStep& step) const;
  Place At(const RegistrationResult& registration, bool has_prior) const;
  // Fills starts_ with what is tried first: the prediction, and others where it is uncertain.
  void SpreadStarts(const PosePrior& prior);
  // ... and where the ground that is seen would lie on what was mapped, for a start that was told.
  void RaiseStarts(const PosePrior& prior, const ScanFeatures& features);
  Tracked Follow(const ScanFeatures& features);
  // Near there, or elsewhere, where that is in doubt.
  struct Located {
    RegistrationResult registration;
    std::optional<Eigen::Vector2d> rival;  // Tracked
    bool is_found = false;                 // elsewhere
  };
  Located Locate(const ScanFeatures& features, Tracked tracked);
  std::optional<Eigen::Vector2d> RivalOf(const std::vector<Place>& places, const Place& best) const;
  bool IsDoubtful(const RegistrationResult& result) const;
  // By what the last scans saw, where there are any and this one goes with them.
  bool CarryOn(const ScanFeatures& features);
  // Whether it is not where the motion before led.
  bool IsUnexpected(const RegistrationResult& found) const;
  // Where the map ends, or the scan is not where and as it was expected: whether the place went
  // elsewhere than the vehicle, as its scans tell. Where the map ends, and where it was known for
  // long, the vehicle is where their motion leads then, in the first case carried on from there;
  // else the place is in doubt. Scans that do not fit to each other mean that it may be anywhere.
  bool Strays(const RegistrationResult& found, const ScanFeatures& features);
  // Goes off the map, if that is where it drove, or where it was told to be.
  bool LeavesMap(const RegistrationResult& tracked, const ScanFeatures& features);
  // To where its own scans say.
  void Go(const ScanMotion& moved);
  // Whether that is near enough to where it is expected.
  bool IsWithinReach(const Pose& T_world_level) const;
  // Whether a place that is not confirmed moved as the vehicle did, as its scans tell, since it was
  // taken up or last did not. At the first scan it did.
  bool MovesAsSeen(const ScanFeatures& features, const RegistrationResult& result);
  bool IsSameStep(const Eigen::Vector4d& difference) const;
  // Whether the last scans that were kept say that this one was taken where it is expected.
  bool GoesWithRecent(const ScanFeatures& features, const PosePrior& expected) const;
  // Whether so much of the ground is mapped that the scan would fit if this were the place.
  bool IsOnMap(const RegistrationResult& result,
               const ScanFeatures& features,
               double unknown_share) const;
  // Whether little of the map is left to hold it, and its own motion brought it there, too.
  bool IsNearEdge(const ScanFeatures& features, const LocalizationResult& result);
  // On the map again.
  bool IsBack(const RegistrationResult& result, const ScanFeatures& features) const;
  bool IsAdrift() const;
  double AdriftReach(const PoseCovariance& covariance) const;
  SearchReach Reach(bool is_doubtful) const;
  // Places around where the scan was expected.
  struct Searched {
    std::optional<RegistrationResult> found;  // likelier than `tracked`, and than all others
    std::optional<Eigen::Vector2d> rival;     // as likely as `tracked`, from there
  };
  Searched Search(const ScanFeatures& features, const RegistrationResult& tracked);
  // Whether a start is so vague that other places in it count.
  bool IsVagueStart() const;
  SearchReach StartReach() const;
  bool IsWithinStart(const Pose& T_world_level) const;
  bool StandsOut(const std::vector<Place>& places, const Place& best) const;
  // Whether a place is where a vehicle that was known to be somewhere can be now.
  enum class Surprise : std::uint8_t {
    kNone,
    kOdd,  // near where it was expected, but the scan does not fit as usual
    kNew,
  };
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
  PoseCovariance Covariance(const LocalizationResult& result) const;
  bool IsHeld(const RegistrationResult& result, const ScanFeatures& features) const;
  LocalizationHealth Judge(const RegistrationResult& result,
                           const ScanFeatures& features,
                           Surprise surprise) const;
  struct Cover {
    MapCover map = MapCover::kNone;
    double cell_m = 0.0;  // of what was mapped, on average
  };
  void NoteCover(MapCover cover);
  Cover CoverAt(const ScanFeatures& features, const Pose& T_world_level) const;
  Eigen::Matrix4d Seen(const RegistrationResult& registration,
                       const Cover& cover,
                       const std::optional<Eigen::Vector2d>& rival) const;
  // The scan, for those that follow, where it is known where it was taken.
  void Keep(const ScanFeatures& features, const LocalizationResult& result, bool is_found);
  void Remember(const LocalizationResult& result, const Eigen::Matrix4d& seen, bool is_found);

  PlaceTrackerOptions options_;
  double max_range_m_;
  double cell_size_m_;
  LocalMap map_;
  MotionModel motion_;
  Confirmation confirmation_;
  bool is_first_ = true;
  bool is_told_ = false;             // where it is at the first scan, and how surely
  StartHint hint_;                   // where it is not
  bool is_elsewhere_ = false;        // it was found, and is not known to be there
  bool was_anywhere_ = false;        // when it was found, and is not known for long
  double scans_ = 1.0;               // from the last scan to the next
  double untracked_ = 0.0;           // of these, expected so far
  bool has_paused_ = false;          // before the scan at hand,
  bool has_stood_ = false;           // meanwhile
  bool has_broken_ = false;          // its motion, before the scan at hand
  bool has_strayed_ = false;         // from its motion, on the map
  double usual_fit_ = 0.0;           // of good results, exponentially forgotten
  int lost_ = 0;                     // scans in a row
  int known_ = 0;                    // good scans in a row
  int unheld_ = 0;                   // scans in a row
  int without_map_ = 0;              // scans in a row on which the map was not all there
  ScanTrail trail_;                  // while it is known where each was taken
  int carried_ = 0;                  // scans in a row, the one at hand as well
  std::optional<OwnStep> own_step_;  // to the scan at hand, from elsewhere
  // From where its own motion leads to where it was found, (x, y, z, yaw): summed up, Strays();
  // and since it was taken up or last moved otherwise, MovesAsSeen(), at first where it is carried.
  Eigen::Vector4d strayed_ = Eigen::Vector4d::Zero();
  Eigen::Vector4d moved_off_ = Eigen::Vector4d::Zero();
  std::optional<Eigen::Vector4d> off_carried_;
  // Of the scan at hand; kept for their memory.
  std::vector<Pose> starts_;
  std::vector<Place> places_;
  ScanFeatures thinned_;
};

}  // namespace atlas
