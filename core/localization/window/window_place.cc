#include "core/localization/window/window_place.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "core/base/fast_floor.h"

namespace atlas {
namespace {

// Of a disc of cells, at `dy` from its middle.
std::int32_t HalfChord(std::int32_t reach, std::int32_t dy) {
  return static_cast<std::int32_t>(std::sqrt(static_cast<float>(reach * reach - dy * dy)));
}

}  // namespace

void WindowPlace::Read(const std::shared_ptr<const Tile>& tile,
                       const TileId& place,
                       const MapProfile& profile,
                       std::int64_t first_segment,
                       const ContentOptions& options,
                       std::uint64_t serial) {
  content_.Read(*tile, place, profile, first_segment, options);
  tile_ = tile;
  first_segment_ = first_segment;
  level_ = tile->id.level;
  serial_ = serial;
}

void WindowPlace::ReadNothing(std::uint64_t serial) {
  content_.Clear();
  tile_.reset();
  level_ = 0;
  serial_ = serial;
}

bool WindowPlace::IsOf(const std::shared_ptr<const Tile>& tile, std::int64_t first_segment) const {
  return tile == nullptr ? content_.is_empty()
                         : first_segment == first_segment_ && tile_.lock() == tile;
}

void WindowPlace::Link(const Nine& around,
                       const MapProfile& profile,
                       const PlaceOptions& options,
                       ClosedMasks& scratch) {
  std::array<std::uint64_t, 9> serials{};
  NineContents contents{};
  bool has_occupied = false;
  for (std::size_t i = 0; i < around.size(); ++i) {
    if (around[i] != nullptr) {
      serials[i] = around[i]->serial();
      contents[i] = &around[i]->content();
      has_occupied = has_occupied || contents[i]->has_occupied();
    }
  }
  if (serials == linked_) {
    return;
  }
  linked_ = serials;
  around_ = around;
  line_options_ = options.lines;
  cells_ = profile.tile_cells;
  cell_size_m_ = static_cast<float>(profile.cell_size_m());
  baseline_cells_ = std::clamp(
      static_cast<std::int32_t>(std::lround(options.slope_baseline_m / cell_size_m_)), 1, cells_);
  rows_.Clear();
  if (has_occupied) {
    rows_.Assign(cells_, ClosedMasks::Border(cells_), scratch.Of(contents, cells_, cell_size_m_));
  }
  lines_.assign(rows_.count(), std::nullopt);
}

// The place that holds a cell up to a place's side away from this one, in which it becomes `cell`;
// null where the window has none.
const WindowPlace* WindowPlace::PlaceOf(WindowCell& cell) const {
  const auto beside = [&](std::int32_t& coordinate) {
    const std::int32_t step = coordinate < 0 ? -1 : (coordinate >= cells_ ? 1 : 0);
    coordinate -= step * cells_;
    return step;
  };
  const std::int32_t dx = beside(cell.x);
  const std::int32_t dy = beside(cell.y);
  return around_[static_cast<std::size_t>(4 + 3 * dy + dx)];
}

Eigen::Vector2f WindowPlace::CenterOf(WindowCell cell) const {
  return {(static_cast<float>(cell.x) + 0.5F) * cell_size_m_,
          (static_cast<float>(cell.y) + 0.5F) * cell_size_m_};
}

bool WindowPlace::IsFree(WindowCell cell, int segment) const {
  const WindowPlace* place = PlaceOf(cell);
  return place != nullptr &&
         place->content_.IsFree(static_cast<std::size_t>(cell.y * cells_ + cell.x), segment);
}

std::optional<ColumnLine> WindowPlace::NearestLine(const Eigen::Vector2f& p,
                                                   int segment,
                                                   float radius_m) const {
  const std::optional<WindowCell> nearest =
      rows_.Nearest(p / cell_size_m_, segment, radius_m / cell_size_m_);
  if (!nearest) {
    return std::nullopt;
  }
  WindowCell cell = *nearest;
  const WindowPlace* place = PlaceOf(cell);
  if (place == nullptr) {
    return std::nullopt;
  }
  ColumnLine line = place->LineAt(cell, segment);
  line.center += cell_size_m_ * Eigen::Vector2f(static_cast<float>(nearest->x - cell.x),
                                                static_cast<float>(nearest->y - cell.y));
  return line;
}

const ColumnLine& WindowPlace::LineAt(WindowCell cell, int segment) const {
  std::optional<ColumnLine>& line = lines_[rows_.Rank(cell, segment)];
  if (!line) {
    line = FitLine(cell, segment);
  }
  return *line;
}

ColumnLine WindowPlace::FitLine(WindowCell cell, int segment) const {
  const auto reach =
      std::min(static_cast<std::int32_t>(std::lround(line_options_.radius_m / cell_size_m_)),
               OccupiedRows::kMaxReach);
  float count = 0.0F;
  Eigen::Vector2f sum = Eigen::Vector2f::Zero();
  Eigen::Matrix2f squares = Eigen::Matrix2f::Zero();
  for (std::int32_t dy = -reach; dy <= reach; ++dy) {
    const std::int32_t width = HalfChord(reach, dy);
    std::uint64_t row = rows_.Around(cell, dy, segment, width);
    for (; row != 0; row &= row - 1) {
      const Eigen::Vector2f offset(static_cast<float>(std::countr_zero(row) - width),
                                   static_cast<float>(dy));
      count += 1.0F;
      sum += offset;
      squares += offset * offset.transpose();
    }
  }
  const Eigen::Vector2f mean = sum / count;
  const Eigen::Matrix2f spread = squares / count - mean * mean.transpose();
  // Closed-form eigenvectors of a symmetric 2x2 matrix: half the angle of (xx - yy, 2 xy).
  const float difference = spread(0, 0) - spread(1, 1);
  const float root = std::hypot(difference, 2.0F * spread(0, 1));
  const float trace = spread.trace();
  const float angle = 0.5F * std::atan2(2.0F * spread(0, 1), difference);
  ColumnLine line;
  line.normal = {-std::sin(angle), std::cos(angle)};
  line.is_wall = count >= 3.0F && (trace - root) < line_options_.max_ratio * (trace + root);
  line.center = CenterOf(cell);
  if (line.is_wall) {
    line.center += cell_size_m_ * mean;
    FindFreeSide(segment, line);
  }
  return line;
}

void WindowPlace::FindFreeSide(int segment, ColumnLine& line) const {
  const auto is_free_at = [&](const Eigen::Vector2f& p) {
    return IsFree({FastFloor(p.x() / cell_size_m_), FastFloor(p.y() / cell_size_m_)}, segment);
  };
  const Eigen::Vector2f arm = line_options_.free_side_m * line.normal;
  const bool is_free_before = is_free_at(line.center + arm);
  const bool is_free_behind = is_free_at(line.center - arm);
  line.is_one_sided = is_free_before != is_free_behind;
  if (line.is_one_sided && is_free_behind) {
    line.normal = -line.normal;
  }
}

std::optional<SurfaceBelow> WindowPlace::NearestSurface(const Eigen::Vector3f& p,
                                                        WindowCell cell,
                                                        float reach_m) const {
  const Eigen::Vector2f offset = p.head<2>() - CenterOf(cell);
  std::optional<SurfaceBelow> nearest;
  for (const float z_m : content_.SurfacesOf(static_cast<std::size_t>(cell.y * cells_ + cell.x))) {
    // No slope carries a surface further than this within its cell.
    if (std::abs(p.z() - z_m) > reach_m + 2.0F * cell_size_m_) {
      continue;
    }
    const SurfacePlane plane{z_m, GradientAt(cell, z_m)};
    const float height_m = p.z() - z_m - plane.gradient.dot(offset);
    if (std::abs(height_m) < reach_m) {
      reach_m = std::abs(height_m);
      nearest = {plane, height_m};
    }
  }
  return nearest;
}

Eigen::Vector2f WindowPlace::GradientAt(WindowCell cell, float z_m) const {
  const std::int32_t reach = baseline_cells_;
  const float span_m = 2.0F * static_cast<float>(reach) * cell_size_m_;
  const auto east = SurfaceNear({cell.x + reach, cell.y}, z_m);
  const auto west = SurfaceNear({cell.x - reach, cell.y}, z_m);
  const auto north = SurfaceNear({cell.x, cell.y + reach}, z_m);
  const auto south = SurfaceNear({cell.x, cell.y - reach}, z_m);
  return {east && west ? (*east - *west) / span_m : 0.0F,
          north && south ? (*north - *south) / span_m : 0.0F};
}

// Of a surface of the cell that is about as high.
std::optional<float> WindowPlace::SurfaceNear(WindowCell cell, float z_m) const {
  constexpr float kReach_m = 0.3F;
  const WindowPlace* place = PlaceOf(cell);
  if (place == nullptr) {
    return std::nullopt;
  }
  for (const float other_m :
       place->content_.SurfacesOf(static_cast<std::size_t>(cell.y * cells_ + cell.x))) {
    if (std::abs(other_m - z_m) < kReach_m) {
      return other_m;
    }
  }
  return std::nullopt;
}

}  // namespace atlas
