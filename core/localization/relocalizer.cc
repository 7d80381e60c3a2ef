#include "core/localization/relocalizer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/localization/registration/pose_prior.h"

namespace atlas {
namespace {

constexpr double kDegree = 0.017453292519943295;

// Of the scan's columns, evenly chosen.
std::vector<Eigen::Vector3d> Chosen(const std::vector<Eigen::Vector3f>& columns,
                                    std::size_t count) {
  std::vector<Eigen::Vector3d> chosen;
  const std::size_t size = std::min(columns.size(), count);
  for (std::size_t i = 0; i < size; ++i) {
    chosen.push_back(columns[i * columns.size() / size].cast<double>());
  }
  return chosen;
}

// Where a scan's columns lie on structure, of headings and places around one.
class Correlation {
 public:
  Correlation(const BlockMap& map, std::vector<Eigen::Vector3d> columns)
      : reader_(map), segment_m_(map.segment_m()), columns_(std::move(columns)) {}

  struct Best {
    int score = -1;
    Pose T_world_level;
  };

  enum class Width { kNear, kExact };
  // `reach` steps either way in both directions and headings; of equals the one nearest to `start`.
  Best Search(
      const Pose& start, Width width, int reach, double step_m, int turns, double turn_rad) {
    Best best;
    for (int turn = 0; turn <= 2 * turns; ++turn) {
      const int signed_turn = (turn % 2 == 0 ? 1 : -1) * ((turn + 1) / 2);
      Pose pose = start;
      pose.linear() =
          Eigen::AngleAxisd(signed_turn * turn_rad, Eigen::Vector3d::UnitZ()) * start.linear();
      for (int j = -reach; j <= reach; ++j) {
        for (int i = -reach; i <= reach; ++i) {
          pose.translation() = start.translation() + step_m * Eigen::Vector3d(i, j, 0.0);
          const int score = Score(pose, width);
          if (score > best.score) {
            best = {score, pose};
          }
        }
      }
    }
    return best;
  }

 private:
  int Score(const Pose& pose, Width width) {
    int score = 0;
    for (const Eigen::Vector3d& column : columns_) {
      const Eigen::Vector3d p = pose * column;
      const auto segment = static_cast<std::int64_t>(std::floor(p.z() / segment_m_));
      const std::uint64_t segments = width == Width::kNear
                                         ? reader_.SegmentsNear(p.x(), p.y(), segment)
                                         : reader_.SegmentsAt(p.x(), p.y(), segment);
      score += (segments & 1) != 0 ? 1 : 0;
    }
    return score;
  }

  BlockMap::Reader reader_;
  double segment_m_;
  std::vector<Eigen::Vector3d> columns_;
};

}  // namespace

std::optional<double> GroundBelow(const LeveledScan& scan) {
  constexpr float kNear_m = 12.0F;
  constexpr std::size_t kEnough = 30;
  std::vector<float> heights;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scan.is_ground[i] != 0 && scan.range_m[i] < kNear_m) heights.push_back(scan.z[i]);
  }
  if (heights.size() < kEnough) {
    return std::nullopt;
  }
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  return static_cast<double>(*middle);
}

Relocalizer::Relocalizer(const MapProfile& profile,
                         std::shared_ptr<const PlaceIndex> places,
                         TilesAround tiles,
                         const RelocalizerOptions& options)
    : profile_(profile), places_(std::move(places)), tiles_(std::move(tiles)), options_(options) {}

Result<Relocalization> Relocalizer::Find(const LeveledScan& scan,
                                         const Eigen::Quaterniond& R_level_sensor,
                                         const std::optional<PlacePrior>& prior) const {
  Relocalization result;
  const std::optional<double> ground_z_m = GroundBelow(scan);
  const ScanFeatures features = ExtractFeatures(scan, options_.features);
  if (!ground_z_m || features.columns.empty()) {
    return result;
  }
  const std::vector<PlaceCandidate> candidates =
      places_->Find(ProfileOf(scan, *ground_z_m), -*ground_z_m, prior, options_.candidates,
                    options_.candidates_apart_m);
  auto places = Refine(features, Check(features, candidates, -*ground_z_m), prior);
  if (!places) return Error(places.error());
  result.places = *std::move(places);
  if (result.places.empty()) {
    return result;
  }
  const double next = result.places.size() > 1 ? result.places[1].score : 0.0;
  result.margin = result.places[0].score - next;
  if (IsBelieved(result, DeckWeight(features, options_.many_columns))) {
    result.T_world_sensor = result.places[0].registration.T_world_level;
    result.T_world_sensor->linear() *= R_level_sensor.toRotationMatrix();
  }
  return result;
}

// The places where most of the scan's columns lie on structure, the best first, all apart.
std::vector<Relocalizer::Start> Relocalizer::Check(const ScanFeatures& features,
                                                   const std::vector<PlaceCandidate>& candidates,
                                                   double sensor_height_m) const {
  constexpr double kStep_m = 0.8;
  std::vector<Start> starts;
  Correlation rough(places_->blocks(), Chosen(features.columns, options_.checked_columns / 2));
  for (const PlaceCandidate& candidate : candidates) {
    Pose pose = Pose::Identity();
    pose.linear() =
        Eigen::AngleAxisd(candidate.yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    pose.translation() = candidate.ground + Eigen::Vector3d(0.0, 0.0, sensor_height_m);
    const auto near = rough.Search(pose, Correlation::Width::kNear, 2, kStep_m, 3, 2.0 * kDegree);
    starts.push_back({near.T_world_level, near.score});
  }
  std::stable_sort(starts.begin(), starts.end(), HasMore);
  starts.resize(std::min(starts.size(), options_.checked_closely));
  Correlation close(places_->blocks(), Chosen(features.columns, options_.checked_columns));
  for (Start& start : starts) {
    const auto exact = close.Search(start.T_world_level, Correlation::Width::kExact, 2,
                                    0.5 * kStep_m, 2, 1.0 * kDegree);
    start = {exact.T_world_level, exact.score};
  }
  std::stable_sort(starts.begin(), starts.end(), HasMore);
  std::vector<Start> apart;
  for (const Start& start : starts) {
    if (start.score < options_.refined_share * starts.front().score) break;
    const bool is_near = std::any_of(apart.begin(), apart.end(), [&](const Start& other) {
      return !AreApart(start.T_world_level, other.T_world_level, options_.refined_apart_m,
                       options_.refined_apart_rad);
    });
    if (!is_near && apart.size() < options_.refined) apart.push_back(start);
  }
  return apart;
}

// One map window serves all decks of a place, and all of them are tried: they look alike.
Result<std::vector<RelocalizedPlace>> Relocalizer::Refine(
    const ScanFeatures& features,
    const std::vector<Start>& starts,
    const std::optional<PlacePrior>& prior) const {
  const auto radius_m = static_cast<double>(options_.features.max_range_m) + 3.0;
  std::vector<RelocalizedPlace> places;
  MapWindow window(profile_, options_.window);
  DeckFinder decks(options_.decks);
  for (const Start& start : starts) {
    const Eigen::Vector3d& center = start.T_world_level.translation();
    const auto tiles = tiles_(center, radius_m);
    if (!tiles) return Error(tiles.error());
    window.Renew(*tiles, center, radius_m);
    RelocalizedPlace place = Placed(window, features, start.T_world_level);
    const Pose T_world_level = place.registration.T_world_level;
    Add(std::move(place), places);
    for (const double up_m : decks.Find(window, features, T_world_level)) {
      Pose pose = T_world_level;
      pose.translation().z() += up_m;
      Add(Placed(window, features, pose), places);
    }
  }
  std::erase_if(places, [&](const RelocalizedPlace& place) {
    const double z_m = place.registration.T_world_level.translation().z();
    return prior && std::abs(z_m - prior->z_m) > prior->height_m;
  });
  std::stable_sort(places.begin(), places.end(),
                   [](const auto& a, const auto& b) { return a.score > b.score; });
  return places;
}

RelocalizedPlace Relocalizer::Placed(const MapWindow& window,
                                     const ScanFeatures& features,
                                     const Pose& start) const {
  RelocalizedPlace place;
  place.registration = Register(window, features, start, options_.registration);
  place.explained = ExplainedShare(place.registration, features);
  place.score = PlaceScore(place.registration, features);
  return place;
}

// Of two that came to the same place the likelier one stays.
void Relocalizer::Add(RelocalizedPlace place, std::vector<RelocalizedPlace>& places) const {
  for (RelocalizedPlace& other : places) {
    if (!AreApart(place.registration.T_world_level, other.registration.T_world_level,
                  options_.refined_apart_m, options_.refined_apart_rad)) {
      if (place.score > other.score) other = std::move(place);
      return;
    }
  }
  places.push_back(std::move(place));
}

bool Relocalizer::IsBelieved(const Relocalization& found, double deck_weight) const {
  const RelocalizedPlace& best = found.places.front();
  return best.registration.fit >= options_.min_fit &&
         WorstSigma(best.registration) <= options_.max_sigma_m &&
         best.registration.column_inliers >= options_.min_columns &&
         best.explained >= options_.min_explained &&
         std::all_of(
             found.places.begin() + 1, found.places.end(),
             [&](const RelocalizedPlace& other) { return IsBehind(other, best, deck_weight); });
}

bool Relocalizer::IsBehind(const RelocalizedPlace& other,
                           const RelocalizedPlace& best,
                           double deck_weight) const {
  const Eigen::Vector3d off = other.registration.T_world_level.translation() -
                              best.registration.T_world_level.translation();
  const bool is_deck = off.head<2>().norm() < options_.decks.apart_m;
  return best.score - other.score >=
         (is_deck ? options_.min_deck_margin / deck_weight : options_.min_margin);
}

}  // namespace atlas
