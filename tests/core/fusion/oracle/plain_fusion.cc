#include "tests/core/fusion/oracle/plain_fusion.h"

#include <algorithm>
#include <set>
#include <vector>

#include "core/base/integer_math.h"
#include "tests/core/fusion/oracle/plain_cell.h"

namespace atlas::testing {
namespace {

// A keyframe against the map's cells, in cells x 2^31.
class PlainResampler {
 public:
  PlainResampler(const PlacedKeyframe& placed,
                 std::uint32_t stretch,
                 const SigmaTable& sigmas,
                 const MapProfile& profile)
      : placed_(placed), stretch_(stretch), sigmas_(sigmas), profile_(profile) {
    const KeyframePlacement& p = placed.placement;
    const Int128 cos = p.cos_yaw;
    const Int128 sin = p.sin_yaw;
    u_origin_ = RoundDiv128(2 * (p.x_um * cos + p.y_um * sin), profile.cell_size_um);
    v_origin_ = RoundDiv128(2 * (p.y_um * cos - p.x_um * sin), profile.cell_size_um);
    center_i_ = FloorDiv(p.x_um, profile.cell_size_um);
    center_j_ = FloorDiv(p.y_um, profile.cell_size_um);
  }

  // Appends the keyframe's words on the world cells of row j from i on, one cell of `row` each.
  void LookAlong(std::int64_t i,
                 std::int64_t j,
                 std::span<std::vector<PlainObservation>> row) const {
    const std::int64_t reach = placed_.keyframe->grid.radius_cells + 1;
    if (std::abs(j - center_j_) > reach) {
      return;
    }
    for (std::vector<PlainObservation>& cell : row) {
      if (std::abs(i - center_i_) <= reach) {
        Look(i, j, cell);
      }
      ++i;
    }
  }

 private:
  // Appends the keyframe's word on world cell (i, j), if it has one.
  void Look(std::int64_t i, std::int64_t j, std::vector<PlainObservation>& out) const {
    const KeyframePlacement& p = placed_.placement;
    const std::int64_t cos = p.cos_yaw;
    const std::int64_t sin = p.sin_yaw;
    const std::int64_t u = cos * (2 * i + 1) + sin * (2 * j + 1) - u_origin_;
    const std::int64_t v = cos * (2 * j + 1) - sin * (2 * i + 1) - v_origin_;
    const std::int64_t fine_u = u >> 15;
    const std::int64_t fine_v = v >> 15;
    const std::int64_t squared = fine_u * fine_u + fine_v * fine_v;
    const std::int64_t radius = placed_.keyframe->grid.radius_cells;
    if (squared < (radius * radius) << 32) {
      Read(static_cast<std::int32_t>(u >> 31), static_cast<std::int32_t>(v >> 31), squared >> 32,
           out);
    }
  }

  void Read(std::int32_t ix,
            std::int32_t iy,
            std::int64_t squared,
            std::vector<PlainObservation>& out) const {
    const Keyframe& keyframe = *placed_.keyframe;
    const std::size_t index = keyframe.grid.Index(ix, iy);
    const KeyframeCell& cell = keyframe.cells[index];
    if (cell.source == AltitudeSource::kNone) {
      return;
    }
    const KeyframePlacement& p = placed_.placement;
    const std::int64_t slope =
        std::int64_t{p.slope_x} * (2 * ix + 1) + std::int64_t{p.slope_y} * (2 * iy + 1);
    const std::int64_t tilt_um = (slope * profile_.cell_size_um) >> 31;
    PlainObservation& observation = out.emplace_back();
    observation.placed = &placed_;
    observation.stretch = stretch_;
    observation.altitude_mm =
        static_cast<std::int32_t>(RoundDiv(p.z_um + 1'000 * cell.altitude_mm + tilt_um, 1'000));
    observation.distance_step = sigmas_.Step(static_cast<std::size_t>(squared));
    observation.source = cell.source;
    observation.occupancy = cell.occupancy;
    observation.column = keyframe.columns[index];
    if (observation.column != 0) {
      observation.column_base = static_cast<std::int32_t>(
          RoundDiv(observation.altitude_mm - cell.altitude_mm, profile_.segment_height_mm) +
          keyframe.anchors[keyframe.BlockIndex(ix, iy)]);
    }
  }

  const PlacedKeyframe& placed_;
  std::uint32_t stretch_;
  const SigmaTable& sigmas_;
  const MapProfile& profile_;
  std::int64_t u_origin_ = 0;
  std::int64_t v_origin_ = 0;
  std::int64_t center_i_ = 0;  // the world cell that the sensor is in
  std::int64_t center_j_ = 0;
};

bool SameStretch(const PlacedKeyframe& a, const PlacedKeyframe& b, const MapProfile& profile) {
  return a.key.session == b.key.session &&
         (profile.preset == FusionPreset::kPaper ||
          a.key.sequence / profile.stretch_keyframes == b.key.sequence / profile.stretch_keyframes);
}

std::vector<const PlacedKeyframe*> InOrder(std::span<const PlacedKeyframe> keyframes) {
  std::vector<const PlacedKeyframe*> order;
  for (const PlacedKeyframe& placed : keyframes) {
    order.push_back(&placed);
  }
  std::sort(order.begin(), order.end(),
            [](const PlacedKeyframe* a, const PlacedKeyframe* b) { return a->key < b->key; });
  return order;
}

}  // namespace

Tile PlainFuseTile(const TileId& id,
                   std::span<const PlacedKeyframe> keyframes,
                   const MapProfile& profile) {
  std::int32_t radius = 1;
  for (const PlacedKeyframe& placed : keyframes) {
    radius = std::max(radius, placed.keyframe->grid.radius_cells);
  }
  const SigmaTable sigmas(profile, radius);
  const std::int64_t side = profile.tile_cells;
  std::size_t cells = 0;
  std::vector<PlainResampler> resamplers;
  std::uint32_t stretch = 0;
  const PlacedKeyframe* previous = nullptr;
  for (const PlacedKeyframe* placed : InOrder(keyframes)) {
    if (previous != nullptr && !SameStretch(*previous, *placed, profile)) {
      ++stretch;
    }
    resamplers.emplace_back(*placed, stretch, sigmas, profile);
    previous = placed;
  }
  Tile tile = EmptyTile(id, profile);
  PlainCell fuser(profile, sigmas);
  std::set<const SessionKey*> used;
  std::vector<std::vector<PlainObservation>> row(static_cast<std::size_t>(side));
  for (std::int64_t j = id.y * side; j < (id.y + 1) * side; ++j) {
    for (const PlainResampler& resampler : resamplers) {
      resampler.LookAlong(id.x * side, j, row);
    }
    for (std::vector<PlainObservation>& cell : row) {
      fuser.Fuse(cell, used, tile.layers);
      cell.clear();
      tile.cell_begin[++cells] = static_cast<std::uint32_t>(tile.layers.size());
    }
  }
  for (const SessionKey* key : used) {
    tile.contributors.push_back(*key);
  }
  std::sort(tile.contributors.begin(), tile.contributors.end());
  tile.contributors.erase(std::unique(tile.contributors.begin(), tile.contributors.end()),
                          tile.contributors.end());
  return tile;
}

}  // namespace atlas::testing
