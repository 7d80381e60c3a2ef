#include "core/localization/window/map_window.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace atlas {
namespace {

// How far the window's middle may be from the vehicle's height before everything is read again.
constexpr std::int64_t kHeightMargin = WindowGrid::kSegments / 8;

}  // namespace

MapWindow::MapWindow(const MapProfile& profile, const PlaceOptions& options)
    : profile_(profile),
      options_(options),
      grid_(profile, Eigen::Vector2d::Zero(), 0.0, WindowGrid::FirstSegment(profile, 0.0)),
      slab_m_(static_cast<float>(profile.slab_margin_mm) * 1e-3F),
      places_(grid_.all_places()) {}

WindowGrid MapWindow::GridAround(const Eigen::Vector3d& center, double radius_m) const {
  const std::int64_t first = WindowGrid::FirstSegment(profile_, center.z());
  const bool is_near = std::abs(first - grid_.first_segment()) <= kHeightMargin;
  return {profile_, center.head<2>(), radius_m, is_near ? grid_.first_segment() : first};
}

void MapWindow::Renew(Tiles tiles, const Eigen::Vector3d& center, double radius_m) {
  const WindowGrid before = std::exchange(grid_, GridAround(center, radius_m));
  TakeOver(before, std::move(places_));
  ReadPlaces(SourcesOf(tiles));
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (places_[i] != nullptr) {
      places_[i]->Link(Around(i), profile_, options_, scratch_);
    }
  }
}

void MapWindow::TakeOver(const WindowGrid& before_grid,
                         std::vector<std::unique_ptr<WindowPlace>> before) {
  places_ = std::vector<std::unique_ptr<WindowPlace>>(grid_.all_places());
  const std::int64_t side = before_grid.places();
  for (std::int64_t i = 0; i < side * side; ++i) {
    auto& place = before[static_cast<std::size_t>(i)];
    if (place == nullptr) {
      continue;
    }
    const std::int64_t x = before_grid.first_place_x() + i % side - grid_.first_place_x();
    const std::int64_t y = before_grid.first_place_y() + i / side - grid_.first_place_y();
    if (x >= 0 && x < grid_.places() && y >= 0 && y < grid_.places()) {
      places_[static_cast<std::size_t>(y * grid_.places() + x)] = std::move(place);
    } else {
      spare_.push_back(std::move(place));
    }
  }
}

// For each place the finest tile that lies over it; null without one.
std::vector<const std::shared_ptr<const Tile>*> MapWindow::SourcesOf(Tiles tiles) const {
  std::vector<const std::shared_ptr<const Tile>*> sources(grid_.all_places(), nullptr);
  const std::int64_t places = grid_.places();
  for (const std::shared_ptr<const Tile>& tile : tiles) {
    const std::int64_t side = std::int64_t{1} << tile->id.level;
    const std::int64_t left = side * tile->id.x - grid_.first_place_x();
    const std::int64_t low = side * tile->id.y - grid_.first_place_y();
    for (std::int64_t y = std::max<std::int64_t>(0, low); y < std::min(places, low + side); ++y) {
      for (std::int64_t x = std::max<std::int64_t>(0, left); x < std::min(places, left + side);
           ++x) {
        auto& source = sources[static_cast<std::size_t>(y * places + x)];
        if (source == nullptr || (*source)->id.level > tile->id.level) {
          source = &tile;
        }
      }
    }
  }
  return sources;
}

void MapWindow::ReadPlaces(const std::vector<const std::shared_ptr<const Tile>*>& sources) {
  const auto give_back = [&](std::size_t i) {
    if (places_[i] != nullptr) spare_.push_back(std::move(places_[i]));
  };
  const auto place_at = [&](std::size_t i) -> WindowPlace& {
    if (places_[i] == nullptr) places_[i] = Spare();
    return *places_[i];
  };
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const bool is_known =
        places_[i] != nullptr &&
        places_[i]->IsOf(sources[i] == nullptr ? nullptr : *sources[i], grid_.first_segment());
    if (sources[i] == nullptr && !is_known) {
      give_back(i);
    } else if (sources[i] != nullptr && !is_known) {
      place_at(i).Read(*sources[i], grid_.IdOf(i), profile_, grid_.first_segment(),
                       options_.content, ++serial_);
    }
  }
  // Beside what stands at a place's edge points find it from outside, too.
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (sources[i] != nullptr) {
      continue;
    }
    if (!IsBesideOccupied(i)) {
      give_back(i);
    } else if (places_[i] == nullptr) {
      place_at(i).ReadNothing(++serial_);
    }
  }
  constexpr std::size_t kMaxSpare = 64;
  spare_.resize(std::min(spare_.size(), kMaxSpare));
}

std::unique_ptr<WindowPlace> MapWindow::Spare() {
  if (spare_.empty()) {
    return std::make_unique<WindowPlace>();
  }
  std::unique_ptr<WindowPlace> place = std::move(spare_.back());
  spare_.pop_back();
  return place;
}

WindowPlace::Nine MapWindow::Around(std::size_t place) const {
  const std::int32_t side = grid_.places();
  const auto x = static_cast<std::int32_t>(place) % side;
  const auto y = static_cast<std::int32_t>(place) / side;
  WindowPlace::Nine nine{};
  for (std::int32_t n = 0; n < 9; ++n) {
    const std::int32_t i = x + n % 3 - 1;
    const std::int32_t j = y + n / 3 - 1;
    if (i >= 0 && i < side && j >= 0 && j < side) {
      nine[static_cast<std::size_t>(n)] = places_[static_cast<std::size_t>(j * side + i)].get();
    }
  }
  return nine;
}

bool MapWindow::IsBesideOccupied(std::size_t place) const {
  const WindowPlace::Nine nine = Around(place);
  return std::any_of(nine.begin(), nine.end(), [](const WindowPlace* beside) {
    return beside != nullptr && beside->content().has_occupied();
  });
}

std::size_t MapWindow::lines() const {
  std::size_t lines = 0;
  for (const auto& place : places_) {
    lines += place != nullptr ? place->rows().count() : 0;
  }
  return lines;
}

std::size_t MapWindow::surfaces() const {
  std::size_t surfaces = 0;
  for (const auto& place : places_) {
    surfaces += place != nullptr ? place->content().surfaces() : 0;
  }
  return surfaces;
}

MapWindow::Local MapWindow::At(const Eigen::Vector2f& p) const {
  const WindowCell cell = grid_.CellAt(p);
  if (!grid_.Contains(cell)) {
    return {};
  }
  const WindowCell in_place = grid_.InPlace(cell);
  return {places_[grid_.PlaceOf(cell)].get(),
          in_place,
          {cell.x - in_place.x, cell.y - in_place.y},
          static_cast<std::size_t>(in_place.y * grid_.place_cells() + in_place.x)};
}

std::optional<ColumnLine> MapWindow::NearestLine(const Eigen::Vector3f& p, float radius_m) const {
  const int segment = grid_.SegmentAt(p.z());
  const Local at = At(p.head<2>());
  if (segment < 0 || at.place == nullptr) {
    return std::nullopt;
  }
  const Eigen::Vector2f corner = grid_.CornerAt(at.first);
  std::optional<ColumnLine> line = at.place->NearestLine(p.head<2>() - corner, segment, radius_m);
  if (line) line->center += corner;
  return line;
}

std::optional<SurfaceBelow> MapWindow::NearestSurface(const Eigen::Vector3f& p,
                                                      float reach_m) const {
  const Local at = At(p.head<2>());
  if (at.place == nullptr) {
    return std::nullopt;
  }
  Eigen::Vector3f in_place = p;
  in_place.head<2>() -= grid_.CornerAt(at.first);
  return at.place->NearestSurface(in_place, at.cell, reach_m);
}

bool MapWindow::IsMapped(const Eigen::Vector3f& p) const {
  const Local at = At(p.head<2>());
  return at.place != nullptr && !at.place->content().SurfacesOf(at.index).empty();
}

std::optional<int> MapWindow::LevelAt(const Eigen::Vector3f& p) const {
  const Local at = At(p.head<2>());
  if (at.place == nullptr || at.place->content().SurfacesOf(at.index).empty()) {
    return std::nullopt;
  }
  return at.place->level();
}

bool MapWindow::IsFree(const Eigen::Vector3f& p) const {
  constexpr float kReach_m = 0.1F;  // what stands at a segment's edge may be counted beside it
  const Local at = At(p.head<2>());
  const int lower = grid_.SegmentAt(p.z() - kReach_m);
  const int upper = grid_.SegmentAt(p.z() + kReach_m);
  if (at.place == nullptr || lower < 0 || upper < 0) {
    return false;
  }
  const PlaceContent& content = at.place->content();
  const auto surfaces = content.SurfacesOf(at.index);
  return content.IsFree(at.index, lower) && content.IsFree(at.index, upper) &&
         std::none_of(surfaces.begin(), surfaces.end(), [&](float surface_z_m) {
           return p.z() < surface_z_m && p.z() > surface_z_m - slab_m_;
         });
}

bool MapWindow::IsOccupied(const Eigen::Vector3f& p) const {
  const int segment = grid_.SegmentAt(p.z());
  const Local at = At(p.head<2>());
  return segment >= 0 && at.place != nullptr && at.place->rows().IsOccupied(at.cell, segment);
}

PointPresence MapWindow::PresenceAt(const Eigen::Vector3f& p, const CellKernel& kernel) const {
  PointPresence presence;
  const int segment = grid_.SegmentAt(p.z());
  const Local at = At(p.head<2>());
  if (segment < 0 || at.place == nullptr) {
    return presence;
  }
  const unsigned nine = at.place->rows().Nine(at.cell, segment);
  if (nine == 0) {
    return presence;
  }
  const float cells_a_m = grid_.cells_a_m();
  const Eigen::Vector2f place = p.head<2>() * cells_a_m;
  const CellKernel::Shares& x = kernel.At(place.x() - static_cast<float>(at.first.x + at.cell.x));
  const CellKernel::Shares& y = kernel.At(place.y() - static_cast<float>(at.first.y + at.cell.y));
  for (std::size_t row = 0; row < 3; ++row) {
    const CellKernel::Share& along = x[(nine >> (3 * row)) & 7U];
    const CellKernel::Share& across = y[std::size_t{1} << row];
    presence.value += along.value * across.value;
    presence.gradient.x() += along.slope * across.value;
    presence.gradient.y() += along.value * across.slope;
    presence.curve_xx += along.curve * across.value;
    presence.curve_xy += along.slope * across.slope;
    presence.curve_yy += along.value * across.curve;
  }
  presence.gradient *= cells_a_m;
  presence.curve_xx *= cells_a_m * cells_a_m;
  presence.curve_xy *= cells_a_m * cells_a_m;
  presence.curve_yy *= cells_a_m * cells_a_m;
  return presence;
}

}  // namespace atlas
