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

namespace atlas {
namespace {

constexpr double kRelocalizationRange_m = 40.0;

RelocalizerOptions OptionsOfRelocalizer() {
  RelocalizerOptions options;
  options.features.max_range_m = static_cast<float>(kRelocalizationRange_m);
  return options;
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

std::vector<FoundScan> ScansOf(const std::vector<AnchorGuess>& guesses) {
  std::vector<FoundScan> scans;
  for (const AnchorGuess& guess : guesses) {
    scans.push_back(guess.scan);
  }
  return scans;
}

// Where they put the drive's ends.
bool AreBeside(const LevelTransform& a, const LevelTransform& b, PartScans scans) {
  constexpr double kBeside_m = 1.0;
  const Pose T_b_a = b.ToPose().inverse() * a.ToPose();
  const auto is_moved = [&](const DriveScan* scan) {
    const Eigen::Vector3d& p = scan->T_world_sensor.translation();
    return (T_b_a * p - p).norm() >= kBeside_m;
  };
  return !is_moved(scans.front()) && !is_moved(scans.back());
}

constexpr std::string_view kForMerge =
    "; if its own poses drift, atlas-merge run aligns sessions that are staged";

}  // namespace

// Scans that were looked for in the whole map.
struct PartAnchoring::Probes {
  PlacePrior prior;  // of the first scan
  std::set<std::size_t> probed;
  std::vector<AnchorGuess> guesses;
};

// How the drive may lie, by guesses that agree, and how its scans fit the map then.
struct PartAnchoring::Candidate {
  std::vector<AnchorGuess> guesses;
  LevelTransform T_map_drive;
  FrameFit fit;
  double support = 0.0;  // of the scans that were found, how well each fits the map
};

Status AnchorOptions::Validate() const {
  ATLAS_RETURN_IF_ERROR(prior.Validate());
  if (probes < 1 || min_agreeing < 2) {
    return {StatusCode::kInvalidArgument, "anchor: expected a probe, and two that agree"};
  }
  return {};
}

PartAnchoring::PartAnchoring(const DriveSurvey& survey,
                             const ScanSource& source,
                             KnownPlaces positions,
                             MapView& view,
                             std::shared_ptr<const PlaceIndex> places,
                             const AnchorOptions& options)
    : source_(source),
      positions_(std::move(positions)),
      options_(options),
      relocalizer_(view.profile(), std::move(places), TilesOf(view), OptionsOfRelocalizer()),
      follower_(survey, source, view, options.follow) {}

Result<PartAnchoring> PartAnchoring::Create(const DriveSurvey& survey,
                                            const MotionDuringScan& motion,
                                            const KnownPlaces& positions,
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
  return PartAnchoring(survey, ScanSource(survey, motion), positions, view, *std::move(places),
                       options);
}

PlacePrior PartAnchoring::PriorOfScan(PartScans scans,
                                      std::size_t index,
                                      const Probes& probes) const {
  const DriveScan& scan = *scans[index];
  if (const auto place = positions_.find(scan.number); place != positions_.end()) {
    return PriorOf(place->second);
  }
  // Wherever the drive begins, this scan is as far from there as in the drive's own frame.
  const Eigen::Vector3d way =
      scan.T_world_sensor.translation() - scans.front()->T_world_sensor.translation();
  const double drift_m = options_.agreement.drift * way.norm();
  PlacePrior prior = probes.prior;
  prior.radius_m += way.head<2>().norm() + drift_m;
  prior.z_m += way.z();
  prior.height_m += drift_m;
  return prior;
}

Status PartAnchoring::Probe(PartScans scans, std::size_t index, Probes& probes) const {
  if (!probes.probed.insert(index).second) return {};
  const DriveScan& scan = *scans[index];
  const Result<LeveledScan> leveled = source_.Read(scan);
  if (!leveled) return leveled.error();
  const Eigen::Quaterniond R_level_sensor = LevelOf(scan);
  const auto found = relocalizer_.Find(*leveled, R_level_sensor, PriorOfScan(scans, index, probes));
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
Status PartAnchoring::ProbeAll(PartScans scans, Probes& probes) const {
  const std::vector<double> way_m = WaysOf(scans);
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

Status PartAnchoring::Track(PartScans scans, bool is_best, Candidate& candidate) {
  std::vector<FoundScan> found = ScansOf(candidate.guesses);
  const std::size_t seed = candidate.guesses[candidate.guesses.size() / 2].index;
  const auto followed = follower_.Follow(scans, seed, FitTransform(found), is_best);
  if (!followed) return followed.error();
  found.clear();
  for (const FollowedScan& scan : *followed) {
    if (scan.is_found) found.push_back(scan.scan);
    candidate.support += scan.fit;
  }
  if (!found.empty()) candidate.T_map_drive = FitTransform(found);
  candidate.fit = MeasureFrame(*followed, candidate.T_map_drive);
  return {};
}

Result<FrameFit> PartAnchoring::Measure(PartScans scans, const LevelTransform& T_map_drive) {
  const auto followed = follower_.Follow(scans, 0, T_map_drive, true);
  if (!followed) return Error(followed.error());
  return MeasureFrame(*followed, T_map_drive);
}

Result<PartAnchor> PartAnchoring::Find(PartScans scans, bool is_first_part) {
  Probes probes;
  if (is_first_part) probes.prior = options_.prior;
  if (Status status = ProbeAll(scans, probes); !status.ok()) return Error(std::move(status));
  std::vector<Candidate> candidates;
  for (auto& guesses : CandidatesOf(probes.guesses, options_.agreement, options_.min_agreeing,
                                    options_.candidates)) {
    // Places where the drive cannot be by its positions are no rivals.
    if (candidates.empty() || LiesAtPositions(scans, FitTransform(ScansOf(guesses)))) {
      candidates.emplace_back().guesses = std::move(guesses);
    }
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
    const bool is_best = &candidate == &candidates.front();
    if (Status status = Track(scans, is_best, candidate); !status.ok()) {
      return Error(std::move(status));
    }
  }
  Settle(scans, candidates, probes, anchor);
  return anchor;
}

bool PartAnchoring::LiesAtPositions(PartScans scans, const LevelTransform& T_map_drive) const {
  return WhyOff(FitPositions(scans, positions_, T_map_drive)).empty();
}

bool PartAnchoring::IsBelieved(std::size_t agreeing, std::size_t elsewhere) const {
  return agreeing >= options_.min_agreeing && agreeing >= options_.min_ratio * elsewhere;
}

void PartAnchoring::Settle(PartScans scans,
                           const std::vector<Candidate>& candidates,
                           const Probes& probes,
                           PartAnchor& anchor) const {
  const Candidate& best = candidates.front();
  const Eigen::Vector3d begin_m =
      best.T_map_drive.ToPose() * scans.front()->T_world_sensor.translation();
  const std::vector<AnchorGuess> believed = BelievedOf(probes.guesses);
  anchor.fit = best.fit;
  anchor.position_fit = FitPositions(scans, positions_, best.T_map_drive);
  const std::string off_positions = WhyOff(anchor.position_fit);
  double elsewhere = 0.0;
  for (const Candidate& other : candidates) {
    // Beside each other they are one place, of which the better one is the right one.
    const bool is_worse_here =
        AreBeside(other.T_map_drive, best.T_map_drive, scans) && other.support < best.support;
    if (&other != &best && !is_worse_here) {
      elsewhere = std::max(elsewhere, other.support);
    }
  }
  const auto off = static_cast<std::size_t>(
      std::count_if(believed.begin(), believed.end(), [&](const AnchorGuess& guess) {
        return OffsetFrom(best.T_map_drive, guess.scan).place_m.norm() >
               options_.follow.max_surprise_m;
      }));
  const std::string bent = WhyBeyond(best.fit, options_.limits);
  if (!IsBelieved(best.fit.tracked, best.fit.astray)) {
    anchor.why_not =
        StrCat(anchor.agreeing, " scans agree on where the drive lies, but of those along its way ",
               best.fit.tracked, " fit the map there and ", best.fit.astray, " do not");
  } else if (!bent.empty()) {
    anchor.why_not = StrCat("the drive is found, but ", bent, kForMerge);
  } else if (off > options_.max_off) {
    anchor.why_not = StrCat("the drive is found, but ", off, " of the ", believed.size(),
                            " scans that were found lie more than ", options_.follow.max_surprise_m,
                            " m from where one transform puts them, expected at most ",
                            options_.max_off, kForMerge);
  } else if (best.support < options_.min_margin * elsewhere) {
    anchor.why_not =
        StrCat("the drive fits the map in two places: where its scans were found ",
               InThousandths(best.support / elsewhere),
               " times as well as elsewhere, expected at least ", options_.min_margin, " times");
  } else if (!off_positions.empty()) {
    anchor.why_not = off_positions;
  } else if (!BeginsWithin(begin_m, probes.prior, options_)) {
    anchor.why_not = StrCat("the drive is found, but begins at (", InThousandths(begin_m.x()), ", ",
                            InThousandths(begin_m.y()), ", ", InThousandths(begin_m.z()),
                            ") m, further from the prior than that is said to be off");
  } else {
    anchor.T_map_drive = best.T_map_drive;
    anchor.begin_m = begin_m;
  }
}

bool BeginsWithin(const Eigen::Vector3d& begin_m,
                  const PlacePrior& prior,
                  const AnchorOptions& options) {
  return (begin_m.head<2>() - prior.center).norm() <=
             prior.radius_m + options.follow.max_surprise_m &&
         std::abs(begin_m.z() - prior.z_m) <= prior.height_m + options.follow.max_surprise_m;
}

}  // namespace atlas
