#include "server/service/sync/sync_area.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <type_traits>
#include <utility>

#include "core/base/hash.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

using Eigen::Vector2d;

// Beyond the world: positions are within 10,000 km.
constexpr double kMaxExtent_m = 1e8;
constexpr double kRounded_m = 1e-6;  // at most, of distances there

Status Refuse(const std::string& why) {
  return {StatusCode::kInvalidArgument, StrCat("sync area: ", why)};
}

bool IsFinite(const Vector2d& point) {
  return point.allFinite();
}

Vector2d Clamped(const Vector2d& point) {
  return point.cwiseMax(-kMaxExtent_m).cwiseMin(kMaxExtent_m);
}

Status Check(const DiscArea& disc) {
  if (!IsFinite(disc.center_m) || !(disc.radius_m >= 0.0)) {
    return Refuse("a disc has a centre and a radius of 0 m or more");
  }
  return {};
}

Status Check(const BoxArea& box) {
  if (!IsFinite(box.min_m) || !IsFinite(box.max_m) || (box.max_m - box.min_m).minCoeff() < 0.0) {
    return Refuse("the lower corner of a box is not above the upper one");
  }
  return {};
}

Status Check(const CorridorArea& corridor) {
  const auto& route = corridor.route_m;
  if (route.empty() || route.size() > SyncArea::kMaxRoutePoints) {
    return Refuse(
        StrCat("a route of ", route.size(), " points, expected 1 to ", SyncArea::kMaxRoutePoints));
  }
  if (!std::all_of(route.begin(), route.end(), &IsFinite) || !(corridor.half_width_m >= 0.0)) {
    return Refuse("a corridor has points and half a width of 0 m or more");
  }
  return {};
}

Status CheckTiles(const std::vector<std::uint64_t>& keys) {
  if (keys.size() > SyncArea::kMaxTiles) {
    return Refuse(StrCat(keys.size(), " tiles, expected at most ", SyncArea::kMaxTiles));
  }
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const auto id = TileId::FromKey(keys[i]);
    if (!id) {
      return Refuse(id.error().message());
    }
    if (i > 0 && keys[i - 1] >= keys[i]) {
      return Refuse(StrCat("tile ", *id, " after ", TileId::FromKey(keys[i - 1]).value(),
                           ", expected rising keys"));
    }
  }
  return {};
}

}  // namespace

Result<SyncArea> SyncArea::Create(MapArea shape, const MapProfile& profile) {
  if (const auto* tiles = std::get_if<TilesArea>(&shape)) {
    std::vector<std::uint64_t> keys(tiles->ids.size());
    std::transform(tiles->ids.begin(), tiles->ids.end(), keys.begin(),
                   [](const TileId& id) { return id.Key(); });
    return OfTiles(std::move(keys), profile);
  }
  Status status;
  Shape checked;
  const auto check = [&](auto&& one) {
    if constexpr (!std::is_same_v<std::decay_t<decltype(one)>, TilesArea>) {
      status = Check(one);
      checked = std::forward<decltype(one)>(one);
    }
  };
  std::visit(check, std::move(shape));
  if (!status.ok()) {
    return Error(std::move(status));
  }
  return SyncArea(std::move(checked), profile);
}

Result<SyncArea> SyncArea::OfTiles(std::vector<std::uint64_t> keys, const MapProfile& profile) {
  if (Status status = CheckTiles(keys); !status.ok()) {
    return Error(std::move(status));
  }
  return SyncArea(Tiles{std::move(keys)}, profile);
}

SyncArea::SyncArea(Shape shape, const MapProfile& profile)
    : shape_(std::move(shape)), tile_m_(profile.tile_size_m()) {
  std::vector<Vector2d> way_m;
  if (auto* disc = std::get_if<DiscArea>(&shape_)) {
    way_m = {Clamped(disc->center_m)};
    reach_m_ = std::min(disc->radius_m, kMaxExtent_m);
  } else if (auto* box = std::get_if<BoxArea>(&shape_)) {
    *box = {Clamped(box->min_m), Clamped(box->max_m)};
    way_m = {0.5 * (box->min_m + box->max_m)};
  } else if (auto* corridor = std::get_if<CorridorArea>(&shape_)) {
    std::transform(corridor->route_m.begin(), corridor->route_m.end(), std::back_inserter(way_m),
                   &Clamped);
    reach_m_ = std::min(corridor->half_width_m, kMaxExtent_m);
  }
  if (way_m.size() == 1) {
    way_m.push_back(way_m[0]);
  }
  double along_m = 0.0;
  for (std::size_t i = 1; i < way_m.size(); ++i) {
    legs_.push_back({way_m[i - 1], way_m[i], along_m});
    along_m += (way_m[i] - way_m[i - 1]).norm();
  }
}

const std::vector<SyncArea::Leg>* SyncArea::shaping_legs() const {
  const bool is_shaped =
      std::holds_alternative<DiscArea>(shape_) || std::holds_alternative<CorridorArea>(shape_);
  return is_shaped ? &legs_ : nullptr;
}

double SyncArea::tile_side_m(std::uint8_t level) const {
  return AtLevel(tile_m_, level);
}

MapSquare SyncArea::SquareOf(const TileId& id, int bits) const {
  const double side_m = tile_side_m(id.level);
  const Vector2d min_m = side_m * Vector2d(id.x, id.y);
  return {min_m, min_m + Vector2d::Constant(side_m * (1 << bits))};
}

bool SyncArea::IsWithinReach(const Leg& leg, const TileId& id, int bits) const {
  const MapSquare square = SquareOf(id, bits);
  if (GapOfBoxes(leg.from_m, leg.to_m, square).norm() > reach_m_ + kRounded_m) {
    return false;  // cheap, and most are
  }
  return NearestTo(leg.from_m, leg.to_m, square).distance_m <= reach_m_;
}

bool SyncArea::Touches(const TileId& id, int bits) const {
  if (const auto* keys = tile_keys()) {
    const std::uint64_t first = id.Key();
    const std::uint64_t last = first + (std::uint64_t{1} << (2 * bits)) - 1;
    const auto found = std::lower_bound(keys->begin(), keys->end(), first);
    return found != keys->end() && *found <= last;
  }
  if (const auto* box = std::get_if<BoxArea>(&shape_)) {
    const MapSquare square = SquareOf(id, bits);
    return (square.min_m.array() <= box->max_m.array()).all() &&
           (square.max_m.array() >= box->min_m.array()).all();
  }
  return std::any_of(legs_.begin(), legs_.end(),
                     [&](const Leg& leg) { return IsWithinReach(leg, id, bits); });
}

TileRect SyncArea::Bounds(std::uint8_t level) const {
  TileRect rect{level};
  if (tile_keys() != nullptr) {
    return rect;
  }
  Vector2d min_m = legs_[0].from_m;
  Vector2d max_m = legs_[0].from_m;
  if (const auto* box = std::get_if<BoxArea>(&shape_)) {
    min_m = box->min_m;
    max_m = box->max_m;
  }
  for (const Leg& leg : legs_) {
    min_m = min_m.cwiseMin(leg.to_m);
    max_m = max_m.cwiseMax(leg.to_m);
  }
  const double side_m = tile_side_m(level);
  const auto coordinate = [side_m](double position_m) {
    return static_cast<std::int32_t>(std::clamp<double>(
        std::floor(position_m / side_m), TileId::kMinCoordinate, TileId::kMaxCoordinate));
  };
  // The tiles that end where it begins touch it, too.
  const double reach_m = reach_m_ + 1e-6;
  rect.min_x = coordinate(min_m.x() - reach_m);
  rect.min_y = coordinate(min_m.y() - reach_m);
  rect.max_x = coordinate(max_m.x() + reach_m);
  rect.max_y = coordinate(max_m.y() + reach_m);
  return rect;
}

const std::vector<std::uint64_t>* SyncArea::tile_keys() const {
  const auto* tiles = std::get_if<Tiles>(&shape_);
  return tiles == nullptr ? nullptr : &tiles->keys;
}

std::size_t SyncArea::bytes() const {
  std::size_t bytes = sizeof(SyncArea) + legs_.capacity() * sizeof(Leg);
  if (const auto* keys = tile_keys()) {
    bytes += keys->capacity() * sizeof(std::uint64_t);
  } else if (const auto* corridor = std::get_if<CorridorArea>(&shape_)) {
    bytes += corridor->route_m.capacity() * sizeof(Vector2d);
  }
  return bytes;
}

std::uint64_t SyncArea::Hash() const {
  ByteWriter out;
  out.U8(static_cast<std::uint8_t>(shape_.index()));
  const auto length = [&out](double length_m) {
    out.U64(std::bit_cast<std::uint64_t>(length_m));
  };
  const auto point = [&length](const Vector2d& point_m) {
    length(point_m.x());
    length(point_m.y());
  };
  if (const auto* disc = std::get_if<DiscArea>(&shape_)) {
    point(disc->center_m);
    length(disc->radius_m);
  } else if (const auto* box = std::get_if<BoxArea>(&shape_)) {
    point(box->min_m);
    point(box->max_m);
  } else if (const auto* corridor = std::get_if<CorridorArea>(&shape_)) {
    length(corridor->half_width_m);
    std::for_each(corridor->route_m.begin(), corridor->route_m.end(), point);
  } else {
    const std::vector<std::uint64_t>& keys = *tile_keys();
    out.Reserve((keys.size() + 1) * sizeof(std::uint64_t));
    std::for_each(keys.begin(), keys.end(), [&out](std::uint64_t key) { out.U64(key); });
  }
  return Hash64(out.bytes());
}

double SyncArea::Nearer(double best_m, const Leg& leg, const MapSquare& square) {
  const double start_m = kAlongWeight * leg.along_m;
  const double gap_m = GapOfBoxes(leg.from_m, leg.to_m, square).norm();
  if (start_m + gap_m - kRounded_m >= best_m) {
    return best_m;  // cheap, and most are
  }
  const Nearest nearest = NearestTo(leg.from_m, leg.to_m, square);
  const double part_m = nearest.part * (leg.to_m - leg.from_m).norm();
  return std::min(best_m, start_m + kAlongWeight * part_m + nearest.distance_m);
}

double SyncArea::Distance(const TileId& id) const {
  if (legs_.empty()) {
    return 0.0;
  }
  const MapSquare square = SquareOf(id, 0);
  double best_m = std::numeric_limits<double>::infinity();
  for (const Leg& leg : legs_) {
    if (kAlongWeight * leg.along_m >= best_m) {
      break;  // nor is any other leg nearer
    }
    best_m = Nearer(best_m, leg, square);
  }
  return best_m;
}

}  // namespace atlas
