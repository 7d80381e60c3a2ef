#include "core/localization/monitor/watched_tile.h"

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <tuple>
#include <utility>

#include "core/geometry/nibble.h"

namespace atlas {
namespace {

bool IsMeasured(const TileLayer& layer) {
  return (layer.flags & TileLayer::kMeasured) != 0;
}

std::uint64_t KeyOf(std::size_t cell, std::int32_t segment) {
  return (std::uint64_t{cell} << 32) | static_cast<std::uint32_t>(segment);
}

// Of a column: looks at which it stood where it should, before it is looked at less often.
constexpr std::uint8_t kCalm = 4;

// The segments of a column that vanished, but for the ends of what stands: something that reaches a
// little way into a segment is not seen by rays through the rest of it.
std::uint32_t WithoutEnds(std::uint32_t vanished, std::uint32_t occupied) {
  const std::uint32_t standing = occupied & ~vanished;
  const std::uint32_t tops = (standing << 1) & ~(occupied >> 1);
  const std::uint32_t bottoms = (standing >> 1) & ~(occupied << 1);
  return vanished & ~tops & ~bottoms;
}

// Segment by segment in, contradictions of one kind on top of each other as one out.
class Joined {
 public:
  explicit Joined(const OnContradiction& out) : out_(out) {}
  ~Joined() { Hand(); }
  Joined(const Joined&) = delete;
  Joined& operator=(const Joined&) = delete;

  void Add(const Contradiction& next) {
    const bool is_same = is_open_ && last_.kind == next.kind && last_.cell_x == next.cell_x &&
                         last_.cell_y == next.cell_y && last_.altitude_mm == next.altitude_mm &&
                         last_.high_mm == next.low_mm;
    if (!is_same) {
      Hand();
      last_ = next;
      is_open_ = true;
      return;
    }
    last_.high_mm = next.high_mm;
    last_.first_scan = std::min(last_.first_scan, next.first_scan);
    last_.last_scan = std::max(last_.last_scan, next.last_scan);
    if (next.score > last_.score) {
      std::tie(last_.hits, last_.passes, last_.score) =
          std::tie(next.hits, next.passes, next.score);
    }
  }

 private:
  void Hand() {
    if (is_open_) out_(last_);
    is_open_ = false;
  }

  const OnContradiction& out_;
  Contradiction last_;
  bool is_open_ = false;
};

}  // namespace

bool IsBelieved(const TileLayer& layer, std::span<const TileLayer> cell) {
  return IsMeasured(layer) || std::none_of(cell.begin(), cell.end(), IsMeasured);
}

WatchedTile::WatchedTile(std::shared_ptr<const Tile> tile,
                         const MapProfile& profile,
                         const WatchOptions& options)
    : tile_(std::move(tile)), profile_(profile) {
  const auto cells = static_cast<std::uint32_t>(tile_->cell_begin.size() - 1);
  for (std::uint32_t cell = 0; cell < cells; ++cell) {
    const auto layers = tile_->Layers(cell);
    for (const TileLayer& layer : layers) {
      if (layer.column == 0 || !IsBelieved(layer, layers)) {
        continue;
      }
      Column column{cell, ColumnBaseIndex(layer.altitude_mm, profile), 0,
                    static_cast<std::uint32_t>(occupied_.size()), layer.altitude_mm};
      for (int k = 0; k < profile.column_segments; ++k) {
        if (NibbleAt(layer.column, k) >= options.occupied_nibble) {
          column.segments |= std::uint32_t{1} << k;
        }
      }
      if (column.segments != 0) {
        occupied_.resize(occupied_.size() +
                         static_cast<std::size_t>(std::popcount(column.segments)));
        columns_.push_back(column);
      }
    }
  }
}

void WatchedTile::AddAppearance(std::size_t cell,
                                const TileLayer& layer,
                                std::int32_t segment,
                                std::uint8_t halves,
                                std::uint32_t scan) {
  const auto [at, is_new] = appearance_at_.try_emplace(
      KeyOf(cell, segment), static_cast<std::uint32_t>(appearances_.size()));
  if (is_new) {
    appearances_.push_back(
        {static_cast<std::uint32_t>(cell), segment, layer.altitude_mm, FreeEvidence()});
  }
  appearances_[at->second].evidence.AddHit(halves, scan);
}

Eigen::Vector2f WatchedTile::OffsetOf(std::uint32_t cell, const Eigen::Vector2f& corner) const {
  const auto size_m = static_cast<float>(profile_.cell_size_m());
  return corner + size_m * Eigen::Vector2f(static_cast<float>(cell % profile_.tile_cells) + 0.5F,
                                           static_cast<float>(cell / profile_.tile_cells) + 0.5F);
}

// The middle of a segment, world frame.
Eigen::Vector3d WatchedTile::PlaceOf(std::uint32_t cell, std::int32_t segment) const {
  const std::uint32_t side = profile_.tile_cells;
  return {tile_->id.x * profile_.tile_size_m() + (cell % side + 0.5) * profile_.cell_size_m(),
          tile_->id.y * profile_.tile_size_m() + (cell / side + 0.5) * profile_.cell_size_m(),
          (segment + 0.5) * profile_.segment_height_m()};
}

float WatchedTile::FootOf(std::int32_t altitude_mm, double sensor_z_m) const {
  return static_cast<float>((altitude_mm + profile_.column_base_offset_mm) * 1e-3 - sensor_z_m);
}

std::uint8_t WatchedTile::HalvesOf(const Column& column, int segment) const {
  // Less of the lower half than this is no gap that rays would find.
  constexpr std::int64_t kLeast_mm = 150;
  const std::int64_t middle_mm = std::int64_t{column.base + segment} * profile_.segment_height_mm +
                                 profile_.segment_height_mm / 2;
  const std::int64_t foot_mm = column.altitude_mm + profile_.column_base_offset_mm;
  return middle_mm - foot_mm < kLeast_mm ? kUpperHalf : kLowerHalf | kUpperHalf;
}

// What stands there look after look and what is hidden is looked at less often, neighbours in turn.
bool WatchedTile::IsDue(const Column& column) const {
  const std::uint32_t turn = looks_ + column.cell + column.cell / profile_.tile_cells;
  return turn % (column.calm == kCalm ? 8 : column.is_hidden ? 2 : 1) == 0;
}

void WatchedTile::Observe(const SightLines& sight, std::uint32_t scan) {
  ++looks_;
  const Eigen::Vector3d& sensor = sight.T_world_level().translation();
  const double side_m = profile_.tile_size_m();
  const Eigen::Vector2f corner(static_cast<float>(tile_->id.x * side_m - sensor.x()),
                               static_cast<float>(tile_->id.y * side_m - sensor.y()));
  const double height_m = profile_.segment_height_m();
  const auto look = [&](std::uint32_t cell, std::int32_t base, std::int32_t altitude_mm,
                        int segments) {
    return sight.Look(OffsetOf(cell, corner), {static_cast<float>(base * height_m - sensor.z()),
                                               FootOf(altitude_mm, sensor.z()), segments});
  };
  for (Column& column : columns_) {
    if (!IsDue(column)) {
      continue;
    }
    const HalvesSeen seen = look(column.cell, column.base, column.altitude_mm,
                                 static_cast<int>(std::bit_width(column.segments)));
    column.is_hidden = (seen.passed | seen.hit) == 0;
    if (column.is_hidden) {
      continue;
    }
    std::uint8_t passed = 0;
    std::uint32_t evidence = column.first;
    for (std::uint32_t left = column.segments; left != 0; left &= left - 1, ++evidence) {
      const int k = std::countr_zero(left);
      occupied_[evidence].Add(seen.Of(k), HalvesOf(column, k), scan);
      passed |= seen.Of(k).passed;
    }
    column.calm = passed == 0 ? std::min<std::uint8_t>(column.calm + 1, kCalm) : 0;
  }
  for (Appearance& appearance : appearances_) {
    const HalvesSeen seen = look(appearance.cell, appearance.segment, appearance.altitude_mm, 1);
    appearance.evidence.AddPass(seen.Of(0), scan);
  }
}

Contradiction WatchedTile::ContradictionAt(std::uint32_t cell,
                                           std::int32_t altitude_mm,
                                           std::int32_t segment,
                                           const Verdict& verdict) const {
  const std::int64_t side = profile_.tile_cells;
  Contradiction found;
  found.kind = verdict.kind;
  found.cell_x = tile_->id.x * side + cell % side;
  found.cell_y = tile_->id.y * side + cell / side;
  found.altitude_mm = altitude_mm;
  found.low_mm = segment * profile_.segment_height_mm;
  found.high_mm = found.low_mm + profile_.segment_height_mm;
  found.hits = verdict.hits;
  found.passes = verdict.passes;
  found.first_scan = verdict.first_scan;
  found.last_scan = verdict.last_scan;
  found.score = verdict.score;
  return found;
}

std::vector<Contradiction> WatchedTile::Vanished(const EvidenceOptions& options) const {
  std::vector<Contradiction> found;
  for (const Column& column : columns_) {
    std::array<std::optional<Verdict>, 16> verdicts;
    std::uint32_t vanished = 0;
    std::uint32_t evidence = column.first;
    for (std::uint32_t left = column.segments; left != 0; left &= left - 1, ++evidence) {
      const int k = std::countr_zero(left);
      const auto at = static_cast<std::size_t>(k);
      verdicts[at] = occupied_[evidence].Judge(HalvesOf(column, k), options);
      vanished |= verdicts[at] ? std::uint32_t{1} << k : 0;
    }
    for (std::uint32_t left = WithoutEnds(vanished, column.segments); left != 0; left &= left - 1) {
      const int k = std::countr_zero(left);
      found.push_back(ContradictionAt(column.cell, column.altitude_mm, column.base + k,
                                      *verdicts[static_cast<std::size_t>(k)]));
    }
  }
  return found;
}

EvidenceSum WatchedTile::HitsAround(const Appearance& appearance) const {
  const std::int32_t side = profile_.tile_cells;
  const auto x = static_cast<std::int32_t>(appearance.cell) % side;
  const auto y = static_cast<std::int32_t>(appearance.cell) / side;
  EvidenceSum sum;
  for (std::int32_t j = std::max(0, y - 1); j <= std::min(side - 1, y + 1); ++j) {
    for (std::int32_t i = std::max(0, x - 1); i <= std::min(side - 1, x + 1); ++i) {
      const auto at =
          appearance_at_.find(KeyOf(static_cast<std::size_t>(j * side + i), appearance.segment));
      if (at != appearance_at_.end()) {
        sum += appearances_[at->second].evidence.sum();
      }
    }
  }
  return sum;
}

void WatchedTile::Report(const EvidenceOptions& options,
                         const ContextOfPlace& context_of,
                         const OnContradiction& on_contradiction) const {
  std::vector<Contradiction> found = Vanished(options);
  for (const Appearance& appearance : appearances_) {
    const Eigen::Vector3d place = PlaceOf(appearance.cell, appearance.segment);
    if (const auto verdict =
            appearance.evidence.Judge(HitsAround(appearance), context_of(place), options)) {
      found.push_back(
          ContradictionAt(appearance.cell, appearance.altitude_mm, appearance.segment, *verdict));
    }
  }
  std::sort(found.begin(), found.end(), [](const Contradiction& a, const Contradiction& b) {
    return std::tie(a.cell_y, a.cell_x, a.altitude_mm, a.low_mm) <
           std::tie(b.cell_y, b.cell_x, b.altitude_mm, b.low_mm);
  });
  Joined joined(on_contradiction);
  for (const Contradiction& contradiction : found) {
    joined.Add(contradiction);
  }
}

}  // namespace atlas
