// The profile behind the golden files: every field set here, so that no default moves them.
#pragma once

#include "core/geometry/map_profile.h"

namespace atlas::testing {

inline MapProfile GoldenProfile() {
  MapProfile profile;
  profile.cell_size_um = 200'000;
  profile.tile_cells = 16;
  profile.levels = 6;
  profile.column_segments = 8;
  profile.segment_height_mm = 1'000;
  profile.column_base_offset_mm = 300;
  profile.vehicle_clearance_mm = 2'500;
  profile.sigma_slope_ppm = 87'489;
  profile.sigma_base_mm = 100;
  profile.sigma_interpolated_mm = 50;
  profile.sigma_extrapolated_mm = 300;
  profile.preset = FusionPreset::kStrict;
  profile.overlap_permille = 600;
  profile.same_layer_mm = 500;
  profile.other_layer_mm = 2'000;
  profile.layer_span_mm = 1'500;
  profile.slab_margin_mm = 700;
  profile.stretch_keyframes = 256;
  profile.sequence_gap = 3;
  profile.band_mm = 2'000;
  profile.band_segments = 16;
  profile.band_vehicle_segments = 4;
  profile.hit_units = 25;
  profile.miss_units = -12;
  profile.stretch_clamp = 64;
  profile.evidence_clamp = 64;
  profile.carry_clamp = 48;
  profile.driven_clamp = 127;
  profile.driven_hold_ms = 60'000;
  profile.origin = GeodeticOrigin{49'013'000'000, -8'400'000'000, 115'000};
  return profile;
}

}  // namespace atlas::testing
