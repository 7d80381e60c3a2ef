#include "tests/bench/monitoring/damaged_map.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "core/base/hash_random.h"
#include "core/geometry/nibble.h"
#include "tests/bench/monitoring/open_map.h"

namespace atlas::testing {
namespace {

constexpr std::uint8_t kSurelyOccupied = 15;
constexpr std::uint8_t kSurelyFree = 2;
constexpr double kCarLength_m = 4.4;
constexpr double kCarWidth_m = 1.8;
constexpr double kCarHeight_m = 1.5;

class Vandal {
 public:
  Vandal(OpenMap& map,
         const MapProfile& profile,
         std::span<const Eigen::Vector3d> way,
         const DamageOptions& options)
      : map_(map), profile_(profile), way_(way), options_(options) {}

  void TurnColumns() {
    using Place = std::pair<std::int64_t, std::int64_t>;
    const auto square = [this](const Eigen::Vector2d& p) {
      return Place(static_cast<std::int64_t>(std::floor(p.x() / options_.square_m)),
                   static_cast<std::int64_t>(std::floor(p.y() / options_.square_m)));
    };
    std::map<Place, bool> has_structure;  // of the squares that are chosen
    map_.ForEach([&](const OpenLayer& open) {
      const Place place = square(open.p);
      HashRandom random(options_.seed, static_cast<std::uint64_t>(place.first),
                        static_cast<std::uint64_t>(place.second));
      if (random.Uniform(0.0, 1.0) < options_.column_share) {
        has_structure[place] |= HasAny(open.layer, IsOccupied);
      }
    });
    map_.ForEach([&](const OpenLayer& open) {
      const auto found = has_structure.find(square(open.p));
      const bool is_chosen = found != has_structure.end() && open.part == ChangePart::kColumns;
      if (!is_chosen || (!found->second && !open.is_believed)) return;
      Turn(open.layer, found->second ? IsOccupied : IsFree);
      SetSurface(open.layer, !found->second);
    });
  }

  std::size_t TakeCars() {
    return AtPlacesBeside([this](const Square& place, double ground_m) {
      constexpr std::size_t kLeast = 40;
      const bool is_car = CountOccupied(place, ground_m, kCarHeight_m) >= kLeast;
      if (is_car) Clear(place, ground_m, kCarHeight_m, ChangePart::kCars);
      return is_car;
    });
  }

  std::size_t PutCars() {
    return AtPlacesBeside([this](const Square& place, double ground_m) {
      const bool is_room = IsRoom(place, ground_m);
      if (is_room) Put(place, ground_m);
      return is_room;
    });
  }

  // The square of structure near the way that holds most.
  void TakeBuilding() {
    constexpr double kHalf_m = 5.0;
    constexpr double kHigh_m = 20.0;
    Square best;
    std::size_t most = 0;
    double ground_m = 0.0;
    for (std::size_t i = 0; i < way_.size(); i += 8) {
      for (double angle = 0.0; angle < 6.28; angle += 0.7854) {
        for (const double away_m : {9.0, 13.0}) {
          const Square place{
              way_[i].head<2>() + away_m * Eigen::Vector2d(std::cos(angle), std::sin(angle)),
              Eigen::Vector2d::Constant(kHalf_m)};
          const std::size_t count = CountOccupied(place, way_[i].z() - kSensor_m, kHigh_m);
          if (count > most) {
            std::tie(best, most, ground_m) = std::tuple(place, count, way_[i].z() - kSensor_m);
          }
        }
      }
    }
    if (most > 0) Clear(best, ground_m, kHigh_m, ChangePart::kBuilding);
  }

 private:
  static constexpr double kSensor_m = 1.8;

  // Tries car-sized places to either side of the way, one after the other, until change(place,
  // ground) changed as many as there are to be cars; how many it did. None overlaps the way or
  // another, and there is one every few metres of the way at most.
  template <typename Change>
  std::size_t AtPlacesBeside(Change&& change) {
    constexpr double kStep_m = 6.0;
    std::size_t changed = 0;
    Eigen::Vector2d last = Eigen::Vector2d::Constant(1e9);
    for (std::size_t i = 0; i + 1 < way_.size(); ++i) {
      const Eigen::Vector2d at = way_[i].head<2>();
      const Eigen::Vector2d ahead = way_[i + 1].head<2>() - at;
      if ((at - last).norm() < kStep_m || ahead.norm() < 1e-3) continue;
      last = at;
      const std::vector<Square> places = PlacesBeside(at, ahead);
      const bool is_changed = std::any_of(places.begin(), places.end(), [&](const Square& place) {
        return !IsOnWay(place) && !IsTaken(place) && change(place, way_[i].z() - kSensor_m);
      });
      changed += is_changed ? 1U : 0U;
      if (changed == static_cast<std::size_t>(options_.cars)) break;
    }
    return changed;
  }

  static std::vector<Square> PlacesBeside(const Eigen::Vector2d& at, const Eigen::Vector2d& ahead) {
    const bool is_along_x = std::abs(ahead.x()) > std::abs(ahead.y());
    const Eigen::Vector2d half = 0.5 * (is_along_x ? Eigen::Vector2d(kCarLength_m, kCarWidth_m)
                                                   : Eigen::Vector2d(kCarWidth_m, kCarLength_m));
    const Eigen::Vector2d left = Eigen::Vector2d(-ahead.y(), ahead.x()).normalized();
    std::vector<Square> places;
    for (const double aside_m : {3.5, -3.5, 5.0, -5.0, 7.0, -7.0}) {
      places.push_back({at + aside_m * left, half});
    }
    return places;
  }

  bool HasAny(const TileLayer& layer, bool (*is_such)(std::uint8_t)) const {
    for (int k = 0; k < profile_.column_segments; ++k) {
      if (is_such(NibbleAt(layer.column, k))) return true;
    }
    return false;
  }
  // Segments that are such into their opposite, as sure.
  void Turn(TileLayer& layer, bool (*is_such)(std::uint8_t)) const {
    for (int k = 0; k < profile_.column_segments; ++k) {
      const std::uint8_t nibble = NibbleAt(layer.column, k);
      if (is_such(nibble)) {
        SetNibble(layer, k, static_cast<std::uint8_t>(2 * kNibbleUnknown - nibble));
      }
    }
  }

  bool IsOnWay(const Square& place) const {
    Square wide = place;
    wide.half.array() += 1.3;
    return std::any_of(way_.begin(), way_.end(),
                       [&](const Eigen::Vector3d& p) { return wide.Contains(p.head<2>()); });
  }
  bool IsTaken(const Square& place) const {
    return std::any_of(taken_.begin(), taken_.end(), [&](const Square& other) {
      return ((place.center - other.center).cwiseAbs().array() < (place.half + other.half).array())
          .all();
    });
  }

  bool IsHere(const TileLayer& layer, double ground_m) const {
    constexpr double kDeck_m = 1.5;
    return std::abs(layer.altitude_mm * 1e-3 - ground_m) < kDeck_m;
  }
  // Segments of a layer's column that stand lower than so much above it.
  int SegmentsUpTo(const TileLayer& layer, double height_m) const {
    const double top_mm = layer.altitude_mm + height_m * 1e3;
    const double base_mm =
        1.0 * ColumnBaseIndex(layer.altitude_mm, profile_) * profile_.segment_height_mm;
    return std::min<int>(
        profile_.column_segments,
        static_cast<int>(std::ceil((top_mm - base_mm) / profile_.segment_height_mm)));
  }

  std::size_t CountOccupied(const Square& place, double ground_m, double height_m) {
    std::size_t count = 0;
    map_.ForEachIn(place, [&](const OpenLayer& open) {
      if (!IsHere(open.layer, ground_m)) return;
      for (int k = 0; k < SegmentsUpTo(open.layer, height_m); ++k) {
        if (IsOccupied(NibbleAt(open.layer.column, k))) ++count;
      }
    });
    return count;
  }

  void Clear(const Square& place, double ground_m, double height_m, ChangePart why) {
    map_.ForEachIn(place, [&](const OpenLayer& open) {
      if (!IsHere(open.layer, ground_m)) return;
      for (int k = 0; k < SegmentsUpTo(open.layer, height_m); ++k) {
        if (IsOccupied(NibbleAt(open.layer.column, k))) SetNibble(open.layer, k, kSurelyFree);
      }
      SetSurface(open.layer, false);
      open.part = why;
    });
    taken_.push_back(place);
  }

  // Free road that was measured.
  bool IsRoom(const Square& place, double ground_m) {
    std::size_t free = 0;
    std::size_t cells = 0;
    map_.ForEachIn(place, [&](const OpenLayer& open) {
      if (!IsHere(open.layer, ground_m) || !open.is_believed) return;
      ++cells;
      if (open.layer.is_traversable() && IsFree(NibbleAt(open.layer.column, 0))) ++free;
    });
    const double cell_m = profile_.cell_size_m();
    const double all = 4.0 * place.half.x() * place.half.y() / (cell_m * cell_m);
    return static_cast<double>(free) > 0.9 * all && free == cells;
  }

  // Its sides: nobody sees into a car.
  void Put(const Square& place, double ground_m) {
    Square inside = place;
    inside.half.array() -= 1.5 * profile_.cell_size_m();
    map_.ForEachIn(place, [&](const OpenLayer& open) {
      if (!IsHere(open.layer, ground_m) || !open.is_believed) return;
      for (int k = 0; k < SegmentsUpTo(open.layer, kCarHeight_m); ++k) {
        SetNibble(open.layer, k, inside.Contains(open.p) ? 0 : kSurelyOccupied);
      }
      SetSurface(open.layer, true);
      open.part = ChangePart::kCars;
    });
    taken_.push_back(place);
  }

  OpenMap& map_;
  const MapProfile& profile_;
  std::span<const Eigen::Vector3d> way_;
  DamageOptions options_;
  std::vector<Square> taken_;
};

// Of two layers of one place, the segments that say the opposite.
void Compare(const TileLayer& before,
             const TileLayer& after,
             const MapProfile& profile,
             std::int32_t lowest,
             ChangedCell& cell) {
  for (int k = 0; k < profile.column_segments; ++k) {
    const int bit = ColumnBaseIndex(before.altitude_mm, profile) + k - lowest;
    if (bit < 0 || bit >= 64) continue;
    const std::uint8_t was = NibbleAt(before.column, k);
    const std::uint8_t is = NibbleAt(after.column, k);
    if (IsOccupied(was) && IsFree(is)) cell.appeared |= std::uint64_t{1} << bit;
    if (IsFree(was) && IsOccupied(is)) cell.vanished |= std::uint64_t{1} << bit;
  }
}

ChangedSegments Compare(const OpenMap& before, const OpenMap& after, const MapProfile& profile) {
  ChangedSegments changes;
  changes.lowest = INT32_MAX;
  for (const auto& [id, tile] : before.tiles()) {
    for (const TileLayer& layer : tile.layers) {
      changes.lowest = std::min(changes.lowest, ColumnBaseIndex(layer.altitude_mm, profile));
    }
  }
  const std::int64_t side = profile.tile_cells;
  for (const auto& [id, tile] : before.tiles()) {
    const Tile& other = after.tiles().at(id);
    for (std::size_t c = 0; c + 1 < tile.cell_begin.size(); ++c) {
      ChangedCell cell;
      cell.x = id.x * side + static_cast<std::int64_t>(c) % side;
      cell.y = id.y * side + static_cast<std::int64_t>(c) / side;
      const auto layers = tile.Layers(c);
      const bool is_none_measured = std::none_of(layers.begin(), layers.end(), IsMeasured);
      for (std::size_t i = tile.cell_begin[c]; i < tile.cell_begin[c + 1]; ++i) {
        if (!is_none_measured && !IsMeasured(tile.layers[i])) continue;
        const bool is_first = (cell.appeared | cell.vanished) == 0;
        Compare(tile.layers[i], other.layers[i], profile, changes.lowest, cell);
        if (is_first && (cell.appeared | cell.vanished) != 0) {
          cell.foot_m = (tile.layers[i].altitude_mm + profile.column_base_offset_mm) * 1e-3;
        }
        cell.part = std::max(cell.part, after.part(id, i));
      }
      if ((cell.appeared | cell.vanished) != 0) changes.Add(cell);
    }
  }
  return changes;
}

}  // namespace

Result<DamagedMap> DamagedMap::Make(MapSource& whole,
                                    std::span<const Eigen::Vector3d> way,
                                    const DamageOptions& options) {
  DamagedMap map(whole.profile());
  OpenMap before(map.profile());
  if (Status status = before.Read(whole); !status.ok()) return Error(std::move(status));
  OpenMap after = before;
  Vandal vandal(after, map.profile(), way, options);
  if (options.is_building_gone) vandal.TakeBuilding();
  if (options.cars > 0) {
    map.cars_gone_ = vandal.TakeCars();
    map.cars_put_ = vandal.PutCars();
  }
  if (options.column_share > 0.0) vandal.TurnColumns();
  for (const auto& [id, tile] : after.tiles()) {
    map.Add(tile);
  }
  map.changes_ = Compare(before, after, map.profile());
  return map;
}

}  // namespace atlas::testing
