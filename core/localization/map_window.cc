#include "core/localization/map_window.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/geometry/nibble.h"

namespace atlas {
namespace {

constexpr int kMaskBits = 64;
constexpr std::int32_t kBlockCells = 16;

struct Corner {
  std::int64_t x;
  std::int64_t y;
};

// Whether a square of cells touches the window's [0, side)^2. Tiles elsewhere may be so far that 32
// bits would bring their cells back.
bool Overlaps(const Corner& first, std::int64_t length, std::int64_t side) {
  return first.x > -length && first.x < side && first.y > -length && first.y < side;
}

bool IsMeasured(const TileLayer& layer) {
  return (layer.flags & TileLayer::kMeasured) != 0;
}

}  // namespace

MapWindow::MapWindow(const MapProfile& profile,
                     std::span<const Tile* const> tiles,
                     const Eigen::Vector3d& center,
                     double radius_m,
                     const MapWindowOptions& options)
    : cell_size_m_(static_cast<float>(profile.cell_size_m())),
      segment_height_m_(static_cast<float>(profile.segment_height_m())),
      slab_m_(static_cast<float>(profile.slab_margin_mm) * 1e-3F) {
  const double cell_m = profile.cell_size_m();
  const double segment_m = profile.segment_height_m();
  first_cell_x_ = static_cast<std::int64_t>(std::floor((center.x() - radius_m) / cell_m));
  first_cell_y_ = static_cast<std::int64_t>(std::floor((center.y() - radius_m) / cell_m));
  side_ = static_cast<std::int32_t>(std::ceil(2.0 * radius_m / cell_m)) + 1;
  first_segment_ = static_cast<std::int64_t>(std::floor(center.z() / segment_m)) - kMaskBits / 2;
  origin_ = {static_cast<double>(first_cell_x_) * cell_m,
             static_cast<double>(first_cell_y_) * cell_m,
             static_cast<double>(first_segment_) * segment_m};
  const auto cells = static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_);
  masks_.assign(cells, 0);
  free_masks_.assign(cells, 0);
  for (const Tile* tile : tiles) {
    AddTile(profile, *tile, options);
  }
  IndexBlocks();
  IndexSurfaces();
  FitGradients(options);
  FitLines(options);
}

void MapWindow::AddTile(const MapProfile& profile,
                        const Tile& tile,
                        const MapWindowOptions& options) {
  const std::int64_t tile_x = std::int64_t{tile.id.x} * profile.tile_cells - first_cell_x_;
  const std::int64_t tile_y = std::int64_t{tile.id.y} * profile.tile_cells - first_cell_y_;
  if (!Overlaps({tile_x, tile_y}, profile.tile_cells, side_)) {
    return;
  }
  for (std::int32_t j = 0; j < profile.tile_cells; ++j) {
    for (std::int32_t i = 0; i < profile.tile_cells; ++i) {
      const CellRef cell{static_cast<std::int32_t>(tile_x + i),
                         static_cast<std::int32_t>(tile_y + j)};
      if (!Contains(cell)) {
        continue;
      }
      const auto layers = tile.Layers(static_cast<std::size_t>(j * profile.tile_cells + i));
      const bool is_any_measured = std::any_of(layers.begin(), layers.end(), IsMeasured);
      for (const TileLayer& layer : layers) {
        if (is_any_measured && !IsMeasured(layer)) {
          continue;  // what stands there does so at a guessed height
        }
        const double z_m = layer.altitude_mm * 1e-3 - origin_.z();
        if (layer.is_traversable() && IsMeasured(layer)) {
          pending_surfaces_.emplace_back(static_cast<std::uint32_t>(Index(cell)),
                                         static_cast<float>(z_m));
        }
        const std::int64_t base = ColumnBaseIndex(layer.altitude_mm, profile) - first_segment_;
        for (int k = 0; k < profile.column_segments; ++k) {
          const std::int64_t bit = base + k;
          const std::uint8_t nibble = NibbleAt(layer.column, k);
          if (nibble == 0 || bit < 0 || bit >= kMaskBits) {
            continue;
          }
          if (nibble >= options.occupied_nibble) {
            masks_[Index(cell)] |= std::uint64_t{1} << bit;
          } else if (nibble <= options.free_nibble) {
            free_masks_[Index(cell)] |= std::uint64_t{1} << bit;
          }
        }
      }
    }
  }
}

void MapWindow::IndexBlocks() {
  side_blocks_ = side_ / kBlockCells + 1;
  near_masks_.assign(
      static_cast<std::size_t>(side_blocks_) * static_cast<std::size_t>(side_blocks_), 0);
  ForEachOccupiedCell([&](CellRef cell, std::uint64_t mask) {
    const std::int32_t x = cell.x / kBlockCells;
    const std::int32_t y = cell.y / kBlockCells;
    for (std::int32_t j = std::max(0, y - 1); j <= std::min(side_blocks_ - 1, y + 1); ++j) {
      for (std::int32_t i = std::max(0, x - 1); i <= std::min(side_blocks_ - 1, x + 1); ++i) {
        near_masks_[static_cast<std::size_t>(j * side_blocks_ + i)] |= mask;
      }
    }
  });
}

void MapWindow::IndexSurfaces() {
  std::stable_sort(pending_surfaces_.begin(), pending_surfaces_.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  surface_begin_.assign(masks_.size() + 1, 0);
  surfaces_.reserve(pending_surfaces_.size());
  for (const auto& [cell, z_m] : pending_surfaces_) {
    ++surface_begin_[cell + 1];
    surfaces_.push_back({z_m, Eigen::Vector2f::Zero()});
  }
  for (std::size_t i = 1; i < surface_begin_.size(); ++i) {
    surface_begin_[i] += surface_begin_[i - 1];
  }
  pending_surfaces_ = {};
}

std::optional<float> MapWindow::SurfaceNear(CellRef cell, float z_m) const {
  constexpr float kReach_m = 0.3F;
  if (!Contains(cell)) {
    return std::nullopt;
  }
  const std::size_t index = Index(cell);
  for (std::uint32_t i = surface_begin_[index]; i < surface_begin_[index + 1]; ++i) {
    if (std::abs(surfaces_[i].z_m - z_m) < kReach_m) {
      return surfaces_[i].z_m;
    }
  }
  return std::nullopt;
}

void MapWindow::FitGradients(const MapWindowOptions& options) {
  const std::int32_t reach =
      std::max(1, static_cast<std::int32_t>(std::lround(options.slope_baseline_m / cell_size_m_)));
  const float baseline_m = 2.0F * static_cast<float>(reach) * cell_size_m_;
  for (std::int32_t y = 0; y < side_; ++y) {
    for (std::int32_t x = 0; x < side_; ++x) {
      const std::size_t index = Index({x, y});
      for (std::uint32_t i = surface_begin_[index]; i < surface_begin_[index + 1]; ++i) {
        SurfacePlane& plane = surfaces_[i];
        const auto east = SurfaceNear({x + reach, y}, plane.z_m);
        const auto west = SurfaceNear({x - reach, y}, plane.z_m);
        const auto north = SurfaceNear({x, y + reach}, plane.z_m);
        const auto south = SurfaceNear({x, y - reach}, plane.z_m);
        plane.gradient.x() = east && west ? (*east - *west) / baseline_m : 0.0F;
        plane.gradient.y() = north && south ? (*north - *south) / baseline_m : 0.0F;
      }
    }
  }
}

void MapWindow::FitLines(const MapWindowOptions& options) {
  first_line_.assign(masks_.size(), 0);
  for (std::int32_t y = 0; y < side_; ++y) {
    for (std::int32_t x = 0; x < side_; ++x) {
      const std::size_t index = Index({x, y});
      first_line_[index] = static_cast<std::uint32_t>(lines_.size());
      for (std::uint64_t mask = masks_[index]; mask != 0; mask &= mask - 1) {
        lines_.push_back(FitLine({x, y}, std::countr_zero(mask), options));
      }
    }
  }
}

ColumnLine MapWindow::FitLine(CellRef cell, int segment, const MapWindowOptions& options) const {
  const auto reach = static_cast<std::int32_t>(std::lround(options.line_radius_m / cell_size_m_));
  const std::uint64_t bit = std::uint64_t{1} << segment;
  float count = 0.0F;
  Eigen::Vector2f sum = Eigen::Vector2f::Zero();
  Eigen::Matrix2f squares = Eigen::Matrix2f::Zero();
  for (std::int32_t dy = -reach; dy <= reach; ++dy) {
    for (std::int32_t dx = -reach; dx <= reach; ++dx) {
      const CellRef other{cell.x + dx, cell.y + dy};
      if (dx * dx + dy * dy <= reach * reach && Contains(other) &&
          (masks_[Index(other)] & bit) != 0) {
        const Eigen::Vector2f offset(static_cast<float>(dx), static_cast<float>(dy));
        count += 1.0F;
        sum += offset;
        squares += offset * offset.transpose();
      }
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
  line.is_wall = count >= 3.0F && (trace - root) < options.max_line_ratio * (trace + root);
  line.center = CellCenter(cell);
  if (line.is_wall) {
    line.center += cell_size_m_ * mean;
    FindFreeSide(segment, options, line);
  }
  return line;
}

void MapWindow::FindFreeSide(int segment, const MapWindowOptions& options, ColumnLine& line) const {
  const Eigen::Vector2f arm = options.free_side_m * line.normal;
  const bool is_free_before = IsFreeAt(line.center + arm, segment);
  const bool is_free_behind = IsFreeAt(line.center - arm, segment);
  line.is_one_sided = is_free_before != is_free_behind;
  if (line.is_one_sided && is_free_behind) {
    line.normal = -line.normal;
  }
}

bool MapWindow::IsFreeAt(const Eigen::Vector2f& p, int segment) const {
  const CellRef cell = CellAt(p.x(), p.y());
  return Contains(cell) && ((free_masks_[Index(cell)] >> segment) & 1) != 0;
}

const ColumnLine* MapWindow::NearestLine(const Eigen::Vector3f& p, float radius_m) const {
  const int segment = SegmentAt(p.z());
  if (segment < 0) {
    return nullptr;
  }
  const CellRef cell = CellAt(p.x(), p.y());
  const auto reach = static_cast<std::int32_t>(std::ceil(radius_m / cell_size_m_));
  const std::uint64_t bit = std::uint64_t{1} << segment;
  if (reach <= kBlockCells && Contains(cell) && (NearMask(cell) & bit) == 0) {
    return nullptr;
  }
  float best = radius_m * radius_m;
  std::size_t best_cell = masks_.size();
  for (std::int32_t y = std::max(0, cell.y - reach); y <= std::min(side_ - 1, cell.y + reach);
       ++y) {
    for (std::int32_t x = std::max(0, cell.x - reach); x <= std::min(side_ - 1, cell.x + reach);
         ++x) {
      const std::size_t index = Index({x, y});
      if ((masks_[index] & bit) == 0) {
        continue;
      }
      const float distance = (CellCenter({x, y}) - p.head<2>()).squaredNorm();
      if (distance < best) {
        best = distance;
        best_cell = index;
      }
    }
  }
  return best_cell == masks_.size() ? nullptr : &LineAt(best_cell, segment);
}

const SurfacePlane* MapWindow::NearestSurface(const Eigen::Vector3f& p,
                                              float reach_m,
                                              float* height_m) const {
  const CellRef cell = CellAt(p.x(), p.y());
  if (!Contains(cell)) {
    return nullptr;
  }
  const std::size_t index = Index(cell);
  const Eigen::Vector2f offset = p.head<2>() - CellCenter(cell);
  const SurfacePlane* best = nullptr;
  for (std::uint32_t i = surface_begin_[index]; i < surface_begin_[index + 1]; ++i) {
    const float height = p.z() - surfaces_[i].z_m - surfaces_[i].gradient.dot(offset);
    if (std::abs(height) < reach_m) {
      reach_m = std::abs(height);
      *height_m = height;
      best = &surfaces_[i];
    }
  }
  return best;
}

bool MapWindow::IsMapped(const Eigen::Vector3f& p) const {
  const CellRef cell = CellAt(p.x(), p.y());
  return Contains(cell) && surface_begin_[Index(cell)] != surface_begin_[Index(cell) + 1];
}

bool MapWindow::IsFree(const Eigen::Vector3f& p) const {
  constexpr float kReach_m = 0.1F;  // what stands at a segment's edge may be counted beside it
  const CellRef cell = CellAt(p.x(), p.y());
  const int lower = SegmentAt(p.z() - kReach_m);
  const int upper = SegmentAt(p.z() + kReach_m);
  if (!Contains(cell) || lower < 0 || upper < 0) {
    return false;
  }
  const std::size_t index = Index(cell);
  const std::uint64_t free = free_masks_[index];
  if (((free >> lower) & (free >> upper) & 1) == 0) {
    return false;
  }
  const auto first = surfaces_.begin() + surface_begin_[index];
  const auto last = surfaces_.begin() + surface_begin_[index + 1];
  return std::none_of(first, last, [&](const SurfacePlane& surface) {
    return p.z() < surface.z_m && p.z() > surface.z_m - slab_m_;
  });
}

bool MapWindow::IsOccupied(const Eigen::Vector3f& p) const {
  const int segment = SegmentAt(p.z());
  const CellRef cell = CellAt(p.x(), p.y());
  return segment >= 0 && Contains(cell) && ((masks_[Index(cell)] >> segment) & 1) != 0;
}

MapWindow::CellRef MapWindow::CellAt(float x_m, float y_m) const {
  return {static_cast<std::int32_t>(std::floor(x_m / cell_size_m_)),
          static_cast<std::int32_t>(std::floor(y_m / cell_size_m_))};
}

bool MapWindow::Contains(CellRef cell) const {
  return cell.x >= 0 && cell.x < side_ && cell.y >= 0 && cell.y < side_;
}

std::size_t MapWindow::Index(CellRef cell) const {
  return static_cast<std::size_t>(cell.y) * static_cast<std::size_t>(side_) +
         static_cast<std::size_t>(cell.x);
}

std::uint64_t MapWindow::NearMask(CellRef cell) const {
  return near_masks_[static_cast<std::size_t>((cell.y / kBlockCells) * side_blocks_ +
                                              cell.x / kBlockCells)];
}

Eigen::Vector2f MapWindow::CellCenter(CellRef cell) const {
  return {(static_cast<float>(cell.x) + 0.5F) * cell_size_m_,
          (static_cast<float>(cell.y) + 0.5F) * cell_size_m_};
}

int MapWindow::SegmentAt(float z_m) const {
  const int segment = static_cast<int>(std::floor(z_m / segment_height_m_));
  return segment >= 0 && segment < kMaskBits ? segment : -1;
}

const ColumnLine& MapWindow::LineAt(std::size_t cell, int segment) const {
  const std::uint64_t below = masks_[cell] & ((std::uint64_t{1} << segment) - 1);
  return lines_[first_line_[cell] + static_cast<std::size_t>(std::popcount(below))];
}

}  // namespace atlas
