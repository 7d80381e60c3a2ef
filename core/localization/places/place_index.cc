#include "core/localization/places/place_index.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/integer_math.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr double kSector_rad = 2.0 * std::numbers::pi / static_cast<double>(RangeProfile::kSectors);

struct Ranked {
  std::uint32_t difference;
  std::uint32_t place;
  std::uint32_t turn;

  auto operator<=>(const Ranked&) const = default;
};

std::uint64_t SquareKey(std::int64_t x, std::int64_t y) {
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32) |
         static_cast<std::uint32_t>(y);
}

double HeadingBetween(std::uint32_t a, std::uint32_t b) {
  const auto turns = static_cast<double>(RangeProfile::kSectors);
  const double difference = std::abs(static_cast<double>(a) - static_cast<double>(b));
  return kSector_rad * std::min(difference, turns - difference);
}

Status CheckReach(const char* name, double reach_m) {
  constexpr double kMost_m = 1e5;
  if (std::isinf(reach_m) || (reach_m > 0.0 && reach_m <= kMost_m)) {
    return {};
  }
  return {StatusCode::kInvalidArgument,
          StrCat("prior: ", name, " ", reach_m, " m: expected more than 0, at most 100,000")};
}

}  // namespace

Status PlacePrior::Validate() const {
  if (!center.allFinite() || !std::isfinite(z_m)) {
    return {StatusCode::kInvalidArgument, "prior: expected finite numbers"};
  }
  ATLAS_RETURN_IF_ERROR(CheckReach("radius", radius_m));
  return CheckReach("height", height_m);
}

PlaceIndex::PlaceIndex(const MapProfile& profile, const PlaceIndexOptions& options)
    : profile_(profile),
      options_(options),
      place_cells_(
          std::max<std::int64_t>(1, std::llround(options.spacing_m / profile.cell_size_m()))),
      blocks_(profile, options.block_m, options.occupied_nibble) {}

void PlaceIndex::Add(const Tile& tile) {
  if (tile.id.level != 0) {
    return;
  }
  blocks_.Add(tile);
  constexpr std::uint8_t kDriveable = TileLayer::kTraversable | TileLayer::kMeasured;
  const std::int64_t first_x = std::int64_t{tile.id.x} * profile_.tile_cells;
  const std::int64_t first_y = std::int64_t{tile.id.y} * profile_.tile_cells;
  for (std::int64_t j = 0; j < profile_.tile_cells; ++j) {
    for (std::int64_t i = 0; i < profile_.tile_cells; ++i) {
      for (const TileLayer& layer :
           tile.Layers(static_cast<std::size_t>(j * profile_.tile_cells + i))) {
        if ((layer.flags & kDriveable) == kDriveable) {
          AddPlace(layer, first_x + i, first_y + j);
        }
      }
    }
  }
}

// One in each square and deck: where its first cell is.
void PlaceIndex::AddPlace(const TileLayer& layer, std::int64_t cell_x, std::int64_t cell_y) {
  const std::int64_t square_x = FloorDiv(cell_x, place_cells_);
  const std::int64_t square_y = FloorDiv(cell_y, place_cells_);
  const double z_m = layer.altitude_mm * 1e-3;
  std::vector<std::size_t>& decks = in_square_[SquareKey(square_x, square_y)];
  const bool is_known = std::any_of(decks.begin(), decks.end(), [&](std::size_t place) {
    return std::abs(places_[place].ground.z() - z_m) < options_.deck_m;
  });
  if (is_known) {
    return;
  }
  decks.push_back(places_.size());
  const double half = 0.5 * static_cast<double>(place_cells_);
  places_.push_back(
      {{(static_cast<double>(square_x * place_cells_) + half) * profile_.cell_size_m(),
        (static_cast<double>(square_y * place_cells_) + half) * profile_.cell_size_m(), z_m},
       {}});
}

void PlaceIndex::Finish() {
  for (Place& place : places_) {
    place.profile = ProfileAt(blocks_, place.ground);
  }
}

std::size_t PlaceIndex::memory_bytes() const {
  return blocks_.memory_bytes() + places_.capacity() * sizeof(Place);
}

bool PlaceIndex::IsNear(const Place& place, double sensor_height_m, const PlacePrior& prior) const {
  const double up_m = place.ground.z() + sensor_height_m - prior.z_m;
  return (place.ground.head<2>() - prior.center).norm() <= prior.radius_m + options_.spacing_m &&
         std::abs(up_m) <= prior.height_m + options_.deck_m;
}

std::vector<PlaceCandidate> PlaceIndex::Find(const RangeProfile& scan,
                                             double sensor_height_m,
                                             const std::optional<PlacePrior>& prior,
                                             std::size_t count,
                                             double apart_m) const {
  constexpr double kApart_rad = 20.0 * std::numbers::pi / 180.0;
  std::vector<Ranked> ranked;
  ranked.reserve(places_.size() * 2);
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Place& place = places_[i];
    if (prior && !IsNear(place, sensor_height_m, *prior)) {
      continue;
    }
    const auto differences = Differences(scan, place.profile);
    // The best heading, and the best of those that are another.
    const auto best = static_cast<std::uint32_t>(
        std::min_element(differences.begin(), differences.end()) - differences.begin());
    std::optional<Ranked> other;
    for (std::uint32_t turn = 0; turn < RangeProfile::kSectors; ++turn) {
      if (HeadingBetween(turn, best) > kApart_rad &&
          (!other || differences[turn] < other->difference)) {
        other = {differences[turn], static_cast<std::uint32_t>(i), turn};
      }
    }
    ranked.push_back({differences[best], static_cast<std::uint32_t>(i), best});
    if (other) ranked.push_back(*other);
  }
  std::sort(ranked.begin(), ranked.end());
  std::vector<Ranked> chosen;
  for (const Ranked& next : ranked) {
    if (chosen.size() == count) {
      break;
    }
    const bool is_near = std::any_of(chosen.begin(), chosen.end(), [&](const Ranked& before) {
      return (places_[next.place].ground - places_[before.place].ground).norm() < apart_m &&
             HeadingBetween(next.turn, before.turn) < kApart_rad;
    });
    if (!is_near) {
      chosen.push_back(next);
    }
  }
  std::vector<PlaceCandidate> candidates;
  for (const Ranked& one : chosen) {
    candidates.push_back({places_[one.place].ground, one.turn * kSector_rad, one.difference});
  }
  return candidates;
}

}  // namespace atlas
