#include "client/drive/anchor/part_anchor.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <string_view>
#include <utility>

#include "client/drive/place_reader.h"
#include "client/drive/tiles_around.h"
#include "core/base/str_cat.h"
#include "core/keyframe/keyframe_builder.h"
#include "core/scan/scan_reader.h"

namespace atlas {
namespace {

constexpr double kRelocalizationRange_m = 40.0;
constexpr double kTrackingRange_m = 100.0;
constexpr std::size_t kLastScans = 10;  // that say how the drive lies here

RelocalizerOptions OptionsOfRelocalizer() {
  RelocalizerOptions options;
  options.features.max_range_m = static_cast<float>(kRelocalizationRange_m);
  return options;
}

Eigen::Quaterniond LevelOf(const DriveScan& scan) {
  return SplitYaw(Eigen::Quaterniond(scan.T_world_sensor.linear())).R_level_sensor;
}

// How far each scan is along the drive.
std::vector<double> WaysOf(std::span<const DriveScan* const> scans) {
  std::vector<double> way_m{0.0};
  for (std::size_t i = 1; i < scans.size(); ++i) {
    way_m.push_back(way_m.back() + (scans[i]->T_world_sensor.translation() -
                                    scans[i - 1]->T_world_sensor.translation())
                                       .norm());
  }
  return way_m;
}

// Up to `count`, evenly spread along the way, at least `spacing_m` apart.
std::vector<std::size_t> SpreadAlong(const std::vector<double>& way_m,
                                     std::size_t count,
                                     double spacing_m) {
  const double step_m = std::max(spacing_m, way_m.back() / static_cast<double>(count));
  std::vector<std::size_t> spread;
  for (std::size_t i = 0; i < way_m.size(); ++i) {
    if (spread.empty() || way_m[i] >= way_m[spread.back()] + step_m) spread.push_back(i);
  }
  return spread;
}

// Each far from those before it: in the order of their indices with the bits reversed.
std::vector<std::size_t> Scattered(const std::vector<std::size_t>& spread) {
  std::vector<std::pair<std::uint32_t, std::size_t>> order;
  for (std::size_t i = 0; i < spread.size(); ++i) {
    std::uint32_t reversed = 0;
    for (int bit = 0; bit < 32; ++bit) {
      reversed |= static_cast<std::uint32_t>((i >> bit) & 1U) << (31 - bit);
    }
    order.emplace_back(reversed, spread[i]);
  }
  std::sort(order.begin(), order.end());
  std::vector<std::size_t> scattered;
  for (const auto& [reversed, index] : order) {
    scattered.push_back(index);
  }
  return scattered;
}

// Whether a scan lies where it was expected, `gap_m` behind the last one that told.
bool IsNear(const Pose& found, const Pose& expected, double gap_m, const AnchorOptions& options) {
  const Eigen::AngleAxisd turned(found.linear().transpose() * expected.linear());
  return (found.translation() - expected.translation()).norm() <=
             options.max_surprise_m + options.agreement.drift * gap_m &&
         turned.angle() <= options.max_surprise_rad;
}

constexpr std::string_view kForMerge =
    "; its own poses drift: atlas-merge run aligns sessions that are staged";

// For people.
double InThousandths(double value) {
  return std::round(value * 1e3) / 1e3;
}

}  // namespace

// Scans that were looked for in the whole map.
struct PartAnchoring::Probes {
  PlacePrior prior;  // of the first scan
  std::set<std::size_t> probed;
  std::vector<AnchorGuess> guesses;
};

// How the drive may lie, by guesses that agree, and which scans fit the map then.
struct PartAnchoring::Candidate {
  std::vector<AnchorGuess> guesses;
  std::vector<FoundScan> tracked;
  std::size_t contradicting = 0;
  std::vector<Pose> astray;  // where scans were expected that are lost there, or weak elsewhere
  AnchorFit fit;
  double support = 0.0;  // of the tracked ones, how well each fits the map
};

Status AnchorOptions::Validate() const {
  ATLAS_RETURN_IF_ERROR(prior.Validate());
  if (probes < 1 || min_agreeing < 2) {
    return {StatusCode::kInvalidArgument, "anchor: expected a probe, and two that agree"};
  }
  return {};
}

PartAnchoring::PartAnchoring(const DriveSurvey& survey,
                             MapView& view,
                             std::shared_ptr<const PlaceIndex> places,
                             const AnchorOptions& options)
    : survey_(survey),
      view_(&view),
      options_(options),
      relocalizer_(view.profile(), std::move(places), TilesOf(view), OptionsOfRelocalizer()),
      localizer_(MakeAtlasLocalizer(survey, kTrackingRange_m, view)) {}

Result<PartAnchoring> PartAnchoring::Create(const DriveSurvey& survey,
                                            MapView& view,
                                            const AnchorOptions& options) {
  if (Status status = options.Validate(); !status.ok()) return Error(std::move(status));
  auto places = ReadPlaces(view);
  if (!places) return Error(places.error());
  if ((*places)->places() == 0) {
    return Error(StatusCode::kNotFound,
                 "anchor: the atlas has no map to find the drive in; the first drive is ingested "
                 "without --anchor, and its frame becomes the atlas's");
  }
  return PartAnchoring(survey, view, *std::move(places), options);
}

Status PartAnchoring::Probe(Scans scans, std::size_t index, Probes& probes) const {
  if (!probes.probed.insert(index).second) return {};
  const DriveScan& scan = *scans[index];
  const Result<PointCloud> cloud = ReadScan(scan.scan);
  if (!cloud) return cloud.error();
  // Wherever the drive begins, this scan is as far from there as in the drive's own frame.
  const Eigen::Vector3d way =
      scan.T_world_sensor.translation() - scans.front()->T_world_sensor.translation();
  const double drift_m = options_.agreement.drift * way.norm();
  PlacePrior prior = probes.prior;
  prior.radius_m += way.head<2>().norm() + drift_m;
  prior.z_m += way.z();
  prior.height_m += drift_m;
  const Eigen::Quaterniond R_level_sensor = LevelOf(scan);
  const LeveledScan leveled =
      SegmentScan(*cloud, survey_.layout, survey_.ring_step, R_level_sensor, {});
  const auto found = relocalizer_.Find(leveled, R_level_sensor, prior);
  if (!found) return found.error().WithContext(StrCat("scan ", scan.number));
  for (const RelocalizedPlace& place : found->places) {
    const bool is_believed = found->T_world_sensor && &place == &found->places.front();
    if (!is_believed && place.registration.fit < options_.min_guess_fit) continue;
    Pose T_map_sensor = place.registration.T_world_level;
    T_map_sensor.linear() *= R_level_sensor.toRotationMatrix();
    probes.guesses.push_back({index, {scan.T_world_sensor, T_map_sensor}, is_believed});
  }
  return {};
}

// Spread over the whole way first, then, where that does not tell, around those that were found.
Status PartAnchoring::ProbeAll(Scans scans,
                               const std::vector<double>& way_m,
                               Probes& probes) const {
  for (const std::size_t i :
       Scattered(SpreadAlong(way_m, options_.probes, options_.probe_spacing_m))) {
    ATLAS_RETURN_IF_ERROR(Probe(scans, i, probes));
    if (IsClear(probes)) return {};
  }
  const std::vector<AnchorGuess> found = BelievedOf(probes.guesses);
  std::size_t left = options_.probes;
  for (const std::size_t i : SpreadAlong(way_m, way_m.size(), options_.probe_spacing_m)) {
    const bool is_around = std::any_of(found.begin(), found.end(), [&](const AnchorGuess& guess) {
      return std::abs(way_m[guess.index] - way_m[i]) <= options_.around_m;
    });
    if (!is_around || left == 0 || probes.probed.contains(i)) continue;
    --left;
    ATLAS_RETURN_IF_ERROR(Probe(scans, i, probes));
    if (IsClear(probes)) return {};
  }
  return {};
}

bool PartAnchoring::IsClear(const Probes& probes) const {
  const std::vector<AnchorGuess> believed = BelievedOf(probes.guesses);
  return believed.size() >= options_.enough_agreeing &&
         AgreeingOf(believed, options_.agreement).size() == believed.size();
}

// From the seed to the end and to the beginning, with what the last ones say of the transform.
Status PartAnchoring::Track(Scans scans, const std::vector<double>& way_m, Candidate& candidate) {
  std::vector<FoundScan> agreeing;
  for (const AnchorGuess& guess : candidate.guesses) {
    agreeing.push_back(guess.scan);
  }
  const Pose T_map_drive = FitTransform(agreeing).T_map_drive.ToPose();
  const std::size_t seed = candidate.guesses[candidate.guesses.size() / 2].index;
  std::vector<std::size_t> forwards;
  std::vector<std::size_t> backwards;
  for (const std::size_t i : SpreadAlong(way_m, way_m.size(), options_.track_spacing_m)) {
    (i >= seed ? forwards : backwards).push_back(i);
  }
  std::reverse(backwards.begin(), backwards.end());
  for (const auto& order : {forwards, backwards}) {
    ATLAS_RETURN_IF_ERROR(Follow(scans, way_m, order, T_map_drive, candidate));
  }
  if (candidate.tracked.empty()) return {};
  candidate.fit = FitTransform(candidate.tracked);
  return {};
}

// Scans in `order`, the first where `T_map_drive` puts it, each where the last ones say.
Status PartAnchoring::Follow(Scans scans,
                             const std::vector<double>& way_m,
                             const std::vector<std::size_t>& order,
                             const Pose& T_map_drive,
                             Candidate& candidate) {
  Pose T_here = T_map_drive;
  double last_m = order.empty() ? 0.0 : way_m[order.front()];
  std::vector<FoundScan> last;
  for (const std::size_t i : order) {
    const Pose expected = T_here * scans[i]->T_world_sensor;
    const Result<LocatedScan> located = LocateNear(*scans[i], expected);
    if (!located) return located.error();
    const bool is_near =
        located->health != LocalizationHealth::kLost &&
        IsNear(located->T_world_sensor, expected, std::abs(way_m[i] - last_m), options_);
    if (located->health != LocalizationHealth::kGood) {
      if (!is_near) candidate.astray.push_back(expected);
      continue;
    }
    if (!is_near) {
      ++candidate.contradicting;
      continue;
    }
    const FoundScan found{scans[i]->T_world_sensor, located->T_world_sensor};
    candidate.tracked.push_back(found);
    candidate.support += located->fit;
    last.push_back(found);
    if (last.size() > kLastScans) last.erase(last.begin());
    T_here = FitTransform(last).T_map_drive.ToPose();
    last_m = way_m[i];
  }
  return {};
}

Result<PartAnchoring::Misfit> PartAnchoring::Measure(Scans scans,
                                                     const LevelTransform& T_map_drive) {
  const std::vector<double> way_m = WaysOf(scans);
  Candidate candidate;
  Status status = Follow(scans, way_m, SpreadAlong(way_m, way_m.size(), options_.track_spacing_m),
                         T_map_drive.ToPose(), candidate);
  if (!status.ok()) return Error(std::move(status));
  Misfit misfit;
  misfit.tracked = candidate.tracked.size();
  misfit.astray = candidate.contradicting;
  for (const Pose& expected : candidate.astray) {
    const Result<bool> is_mapped = IsMapped(expected);
    if (!is_mapped) return Error(is_mapped.error());
    misfit.astray += *is_mapped ? 1U : 0U;
  }
  for (const FoundScan& scan : candidate.tracked) {
    misfit.rms_m +=
        (scan.T_map_sensor.translation() - T_map_drive.ToPose() * scan.T_drive_sensor.translation())
            .squaredNorm();
  }
  if (misfit.tracked > 0) {
    misfit.rms_m = std::sqrt(misfit.rms_m / static_cast<double>(misfit.tracked));
  }
  return misfit;
}

Result<LocatedScan> PartAnchoring::LocateNear(const DriveScan& scan, const Pose& T_map_sensor) {
  constexpr StartHint kFollowed{0.5, 0.05};  // the scans before it tell where it is
  const Result<PointCloud> cloud = ReadScan(scan.scan);
  if (!cloud) return Error(cloud.error());
  localizer_->Start(T_map_sensor, kFollowed);
  auto located = localizer_->Locate(*cloud, LevelOf(scan), 1.0);
  if (!located) return Error(located.error().WithContext(StrCat("scan ", scan.number)));
  return located;
}

// Whether the map has ground below a sensor there, or beside it.
Result<bool> PartAnchoring::IsMapped(const Pose& T_map_sensor) const {
  constexpr double kBeside_m = 2.0;
  constexpr double kNear_m = 1.5;
  const Eigen::Vector3d& p = T_map_sensor.translation();
  const double ground_z_m = p.z() - survey_.mount.height_m;
  for (const double dx_m : {0.0, -kBeside_m, kBeside_m}) {
    for (const double dy_m : {0.0, -kBeside_m, kBeside_m}) {
      const auto layers = view_->LayersAt({p.x() + dx_m, p.y() + dy_m});
      if (!layers) return Error(layers.error());
      const bool is_near = std::any_of(layers->begin(), layers->end(), [&](const TileLayer& layer) {
        return std::abs(1e-3 * layer.altitude_mm - ground_z_m) <= kNear_m;
      });
      if (is_near) return true;
    }
  }
  return false;
}

Result<PartAnchor> PartAnchoring::Find(Scans scans, bool is_first_part) {
  const std::vector<double> way_m = WaysOf(scans);
  Probes probes;
  if (is_first_part) probes.prior = options_.prior;
  if (Status status = ProbeAll(scans, way_m, probes); !status.ok()) return Error(std::move(status));
  std::vector<Candidate> candidates;
  for (auto& guesses : CandidatesOf(probes.guesses, options_.agreement, options_.min_agreeing,
                                    options_.candidates)) {
    candidates.emplace_back().guesses = std::move(guesses);
  }
  PartAnchor anchor;
  anchor.probed = probes.probed.size();
  anchor.found = BelievedOf(probes.guesses).size();
  anchor.agreeing = candidates.front().guesses.size();
  if (!IsBelieved(anchor.agreeing, anchor.found - anchor.agreeing)) {
    anchor.why_not =
        StrCat("of ", anchor.probed, " scans that were looked for ", anchor.found,
               " were found in the map, and ", anchor.agreeing,
               " agree on where the drive lies; expected ", options_.min_agreeing, " or more, and ",
               options_.min_ratio, " times as many as lie elsewhere",
               2 * anchor.found >= anchor.probed && anchor.found >= options_.min_agreeing
                   ? kForMerge
                   : std::string_view());
    return anchor;
  }
  for (Candidate& candidate : candidates) {
    if (Status status = Track(scans, way_m, candidate); !status.ok()) {
      return Error(std::move(status));
    }
  }
  Settle(candidates, scans.front()->T_world_sensor, probes.prior, anchor);
  return anchor;
}

bool PartAnchoring::IsBelieved(std::size_t agreeing, std::size_t elsewhere) const {
  return agreeing >= options_.min_agreeing && agreeing >= options_.min_ratio * elsewhere;
}

void PartAnchoring::Settle(const std::vector<Candidate>& candidates,
                           const Pose& first,
                           const PlacePrior& prior,
                           PartAnchor& anchor) const {
  const Candidate& best = candidates.front();
  const Eigen::Vector3d begin_m = best.fit.T_map_drive.ToPose() * first.translation();
  anchor.tracked = best.tracked.size();
  anchor.contradicting = best.contradicting;
  anchor.rms_m = best.fit.rms_m;
  anchor.rms_yaw_rad = best.fit.rms_yaw_rad;
  double elsewhere = 0.0;
  for (std::size_t i = 1; i < candidates.size(); ++i) {
    elsewhere = std::max(elsewhere, candidates[i].support);
  }
  if (!IsBelieved(anchor.tracked, anchor.contradicting)) {
    anchor.why_not =
        StrCat(anchor.agreeing, " scans agree on where the drive lies, but of those around them ",
               anchor.tracked, " fit the map there and ", anchor.contradicting, " do not");
  } else if (best.fit.rms_m > options_.max_rms_m) {
    anchor.why_not =
        StrCat("the drive is found, but bent against the map: ", InThousandths(best.fit.rms_m),
               " m RMS from one transform, expected at most ", options_.max_rms_m, " m", kForMerge);
  } else if (best.support < options_.min_margin * elsewhere) {
    anchor.why_not =
        StrCat("the drive fits the map in two places: where its scans were found ",
               InThousandths(best.support / elsewhere),
               " times as well as elsewhere, expected at least ", options_.min_margin, " times");
  } else if (!BeginsWithin(begin_m, prior, options_)) {
    anchor.why_not = StrCat("the drive is found, but begins at (", InThousandths(begin_m.x()), ", ",
                            InThousandths(begin_m.y()), ", ", InThousandths(begin_m.z()),
                            ") m, further from the prior than that is said to be off");
  } else {
    anchor.T_map_drive = best.fit.T_map_drive;
    anchor.begin_m = begin_m;
  }
}

bool BeginsWithin(const Eigen::Vector3d& begin_m,
                  const PlacePrior& prior,
                  const AnchorOptions& options) {
  return (begin_m.head<2>() - prior.center).norm() <= prior.radius_m + options.max_surprise_m &&
         std::abs(begin_m.z() - prior.z_m) <= prior.height_m + options.max_surprise_m;
}

}  // namespace atlas
