// The numbers that one atlas agrees on: fixed when it is created, sent in the handshake, hashed
// into every blob. All integers, so that two profiles are equal exactly when their bytes are.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

// Frozen numbers (docs/formats/profile.md).
enum class FusionPreset : std::uint8_t {
  kPaper = 0,    // the paper's rules to the letter
  kStrict = 1,   // with gates on what is one layer; the default
  kBounded = 2,  // strict over the latest stretches: its cost does not grow with the passes
};

// "paper", "strict", "bounded"; nothing for another name.
std::string_view FusionPresetName(FusionPreset preset);
std::optional<FusionPreset> FusionPresetByName(std::string_view name);

// WGS84 coordinates of the world frame's origin.
struct GeodeticOrigin {
  std::int64_t latitude_nanodeg = 0;
  std::int64_t longitude_nanodeg = 0;
  std::int64_t altitude_mm = 0;

  friend bool operator==(const GeodeticOrigin&, const GeodeticOrigin&) = default;
};

struct MapProfile {
  // Grid. Paper: 0.1 m cells.
  std::uint32_t cell_size_um = 100'000;
  std::uint16_t tile_cells = 128;  // cells along a tile's side, every level
  std::uint8_t levels = 8;         // pyramid levels; level l has cells of cell_size << l

  // Nibble columns (paper III-D): segments of 4 bits, on the lattice of multiples of their height.
  std::uint8_t column_segments = 8;           // 2, 4, 8 or 16
  std::uint16_t segment_height_mm = 1'000;    // paper: 8 segments over 8 m
  std::uint16_t column_base_offset_mm = 300;  // returns lower than this above ground are not column

  // A vehicle passes below what hangs higher than this above its ground.
  std::uint16_t vehicle_clearance_mm = 2'500;

  // sigma(d) = slope * d + base (paper III-B: tan 5 deg and 0.1 m); guessed altitudes get more.
  std::uint32_t sigma_slope_ppm = 87'489;
  std::uint16_t sigma_base_mm = 100;
  std::uint16_t sigma_interpolated_mm = 200;
  std::uint16_t sigma_extrapolated_mm = 300;

  // Layers (paper III-C, eq. 1). Gates: preset strict and bounded only.
  FusionPreset preset = FusionPreset::kStrict;
  std::uint16_t overlap_permille = 600;  // epsilon of the overlap rate; no other yet
  std::uint16_t same_layer_mm = 500;     // closer than this: one layer
  std::uint16_t other_layer_mm = 2'000;  // farther than this: two layers
  std::uint16_t layer_span_mm = 1'500;   // no layer is thicker
  std::uint16_t slab_margin_mm = 700;    // columns end this far below the next layer
  // A session is surveyed in stretches of this many sequence numbers: what a pose correction costs.
  std::uint16_t stretch_keyframes = 256;
  std::uint16_t sequence_gap = 3;  // preset paper: a segment bridges this difference in sequence

  // Preset bounded: of each cell and band of altitude, the segments that were seen last.
  std::uint16_t band_mm = 2'000;
  std::uint8_t band_segments = 8;
  std::uint8_t band_vehicle_segments = 3;  // of one vehicle

  // Evidence in units of ln(9)/64, so that +-64 is the probability 0.9 / 0.1 that a nibble ends at.
  std::int16_t hit_units = 25;       // p = 0.7
  std::int16_t miss_units = -12;     // p = 0.4
  std::int16_t stretch_clamp = 64;   // one stretch's say in a cell
  std::int16_t evidence_clamp = 64;  // all stretches together
  // Beside what a later stretch says, all before it counts for this much: so that one stretch can
  // turn what many agreed on, a car that left after years, into its opposite.
  std::int16_t carry_clamp = 48;
  // Where the vehicle itself was (kNibbleFree) its stretch's evidence falls to minus this; below
  // -stretch_clamp hits do not count there, so that what follows leaves no trail ...
  std::int16_t driven_clamp = 127;
  // ... for so long, in this and in later stretches of the session.
  std::uint32_t driven_hold_ms = 60'000;

  std::optional<GeodeticOrigin> origin;

  // A profile that versions 1 or 2 encoded, as it was: blobs name the hash of these bytes. The
  // fields say what is made of it now, and are not to be changed then. Else empty.
  Bytes earlier_encoding;

  double cell_size_m() const { return cell_size_um * 1e-6; }
  double segment_height_m() const { return segment_height_mm * 1e-3; }
  double tile_size_m() const { return cell_size_m() * tile_cells; }

  // kInvalidArgument naming the first field out of its range.
  Status Validate() const;

  // Canonical encoding (docs/formats/profile.md) and its Hash64.
  Bytes Encode() const;
  static Result<MapProfile> Decode(ByteSpan bytes);
  std::uint64_t Hash() const;

  friend bool operator==(const MapProfile&, const MapProfile&) = default;
};

}  // namespace atlas
