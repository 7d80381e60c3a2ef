#include "server/service/sync/sync_area.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

using Eigen::Vector2d;

// Beyond the world: positions are within 10,000 km.
constexpr double kMaxExtent_m = 1e8;
// So much more to drive counts as this much farther off.
constexpr double kAlongWeight = 0.25;

Status Refuse(const std::string& why) {
  return {StatusCode::kInvalidArgument, StrCat("sync area: ", why)};
}

bool IsFinite(const Vector2d& point) {
  return point.allFinite();
}

Vector2d Clamped(const Vector2d& point) {
  return point.cwiseMax(-kMaxExtent_m).cwiseMin(kMaxExtent_m);
}

// From a point to a square; 0 inside.
double Gap(const Vector2d& point, const Vector2d& min_m, const Vector2d& max_m) {
  return (min_m - point).cwiseMax(point - max_m).cwiseMax(0.0).norm();
}

struct Nearest {
  double distance_m = std::numeric_limits<double>::infinity();
  double part = 0.0;  // of the segment, 0 to 1

  void Take(double distance, double at) {
    if (distance < distance_m) {
      *this = {distance, at};
    }
  }
};

// Of a segment to a square.
Nearest NearestTo(const Vector2d& from,
                  const Vector2d& to,
                  const Vector2d& min_m,
                  const Vector2d& max_m) {
  Nearest nearest;
  nearest.Take(Gap(from, min_m, max_m), 0.0);
  nearest.Take(Gap(to, min_m, max_m), 1.0);
  const Vector2d step = to - from;
  const double squared = step.squaredNorm();
  if (squared == 0.0 || nearest.distance_m == 0.0) {
    return nearest;
  }
  // Where it crosses the square: the part of it that is within both slabs.
  double enter = 0.0;
  double leave = 1.0;
  for (int axis = 0; axis < 2; ++axis) {
    if (step[axis] == 0.0) {
      if (from[axis] < min_m[axis] || from[axis] > max_m[axis]) {
        enter = 2.0;
      }
      continue;
    }
    const double a = (min_m[axis] - from[axis]) / step[axis];
    const double b = (max_m[axis] - from[axis]) / step[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  if (enter <= leave) {
    return {0.0, enter};
  }
  for (const Vector2d& corner :
       {min_m, Vector2d(max_m.x(), min_m.y()), Vector2d(min_m.x(), max_m.y()), max_m}) {
    const double part = std::clamp((corner - from).dot(step) / squared, 0.0, 1.0);
    nearest.Take((from + part * step - corner).norm(), part);
  }
  return nearest;
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

Status Check(const TilesArea& tiles) {
  if (tiles.ids.size() > SyncArea::kMaxTiles) {
    return Refuse(StrCat(tiles.ids.size(), " tiles, expected at most ", SyncArea::kMaxTiles));
  }
  for (std::size_t i = 1; i < tiles.ids.size(); ++i) {
    if (tiles.ids[i - 1].Key() >= tiles.ids[i].Key()) {
      return Refuse(
          StrCat("tile ", tiles.ids[i], " after ", tiles.ids[i - 1], ", expected rising keys"));
    }
  }
  return {};
}

}  // namespace

Result<SyncArea> SyncArea::Create(MapArea shape, const MapProfile& profile) {
  Status status = std::visit([](const auto& s) { return Check(s); }, shape);
  if (!status.ok()) {
    return Error(std::move(status));
  }
  return SyncArea(std::move(shape), profile);
}

SyncArea::SyncArea(MapArea shape, const MapProfile& profile)
    : shape_(std::move(shape)), tile_m_(profile.tile_size_m()) {
  if (auto* disc = std::get_if<DiscArea>(&shape_)) {
    way_m_ = {Clamped(disc->center_m)};
    reach_m_ = std::min(disc->radius_m, kMaxExtent_m);
  } else if (auto* box = std::get_if<BoxArea>(&shape_)) {
    *box = {Clamped(box->min_m), Clamped(box->max_m)};
    way_m_ = {0.5 * (box->min_m + box->max_m)};
  } else if (auto* corridor = std::get_if<CorridorArea>(&shape_)) {
    for (const Vector2d& point : corridor->route_m) {
      way_m_.push_back(Clamped(point));
    }
    reach_m_ = std::min(corridor->half_width_m, kMaxExtent_m);
  }
  double along_m = 0.0;
  for (std::size_t i = 0; i < way_m_.size(); ++i) {
    along_m += i > 0 ? (way_m_[i] - way_m_[i - 1]).norm() : 0.0;
    along_m_.push_back(along_m);
  }
}

SyncArea::Square SyncArea::SquareOf(const TileId& id, int bits) const {
  const double side_m = std::ldexp(tile_m_, id.level);
  const Vector2d min_m = side_m * Vector2d(id.x, id.y);
  return {min_m, min_m + Vector2d::Constant(std::ldexp(side_m, bits))};
}

bool SyncArea::Touches(const TileId& id, int bits) const {
  if (const auto* tiles = std::get_if<TilesArea>(&shape_)) {
    const std::uint64_t first = id.Key();
    const std::uint64_t last = first + (std::uint64_t{1} << (2 * bits)) - 1;
    const auto found = std::partition_point(tiles->ids.begin(), tiles->ids.end(),
                                            [&](const TileId& tile) { return tile.Key() < first; });
    return found != tiles->ids.end() && found->Key() <= last;
  }
  const Square square = SquareOf(id, bits);
  if (const auto* box = std::get_if<BoxArea>(&shape_)) {
    return (square.min_m.array() <= box->max_m.array()).all() &&
           (square.max_m.array() >= box->min_m.array()).all();
  }
  if (way_m_.size() == 1) {
    return Gap(way_m_[0], square.min_m, square.max_m) <= reach_m_;
  }
  for (std::size_t i = 1; i < way_m_.size(); ++i) {
    if (NearestTo(way_m_[i - 1], way_m_[i], square.min_m, square.max_m).distance_m <= reach_m_) {
      return true;
    }
  }
  return false;
}

TileRect SyncArea::Bounds(std::uint8_t level) const {
  TileRect rect{level};
  if (std::holds_alternative<TilesArea>(shape_)) {
    return rect;
  }
  Vector2d min_m = way_m_[0];
  Vector2d max_m = way_m_[0];
  if (const auto* box = std::get_if<BoxArea>(&shape_)) {
    min_m = box->min_m;
    max_m = box->max_m;
  }
  for (const Vector2d& point : way_m_) {
    min_m = min_m.cwiseMin(point);
    max_m = max_m.cwiseMax(point);
  }
  const double side_m = std::ldexp(tile_m_, level);
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

const std::vector<TileId>* SyncArea::tiles() const {
  const auto* tiles = std::get_if<TilesArea>(&shape_);
  return tiles == nullptr ? nullptr : &tiles->ids;
}

double SyncArea::Distance(const TileId& id) const {
  if (way_m_.empty()) {
    return 0.0;
  }
  const Square square = SquareOf(id, 0);
  double best_m = Gap(way_m_[0], square.min_m, square.max_m);
  for (std::size_t i = 1; i < way_m_.size(); ++i) {
    const Nearest nearest = NearestTo(way_m_[i - 1], way_m_[i], square.min_m, square.max_m);
    const double along_m = along_m_[i - 1] + nearest.part * (along_m_[i] - along_m_[i - 1]);
    best_m = std::min(best_m, nearest.distance_m + kAlongWeight * along_m);
  }
  return best_m;
}

}  // namespace atlas
