#include "core/geometry/map_profile.h"

#include <algorithm>
#include <array>

#include "core/base/hash.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr std::uint8_t kProfileVersion = 3;
constexpr std::array<std::string_view, 3> kPresetNames = {"paper", "strict", "bounded"};

Status OutOfRange(const char* field, double value, const char* range) {
  return Status(StatusCode::kInvalidArgument,
                StrCat("map profile: ", field, " is ", value, ", expected ", range));
}

bool IsPowerOfTwo(unsigned value) {
  return value != 0 && (value & (value - 1)) == 0;
}

Status ValidateGrid(const MapProfile& profile) {
  if (profile.cell_size_um < 20'000 || profile.cell_size_um > 1'000'000) {
    return OutOfRange("cell size in metres", profile.cell_size_m(), "0.02 to 1");
  }
  if (!IsPowerOfTwo(profile.tile_cells) || profile.tile_cells < 16 || profile.tile_cells > 256) {
    return OutOfRange("cells per tile side", profile.tile_cells, "16, 32, 64, 128 or 256");
  }
  if (profile.levels < 1 || profile.levels > 16) {
    return OutOfRange("pyramid levels", profile.levels, "1 to 16");
  }
  if (!IsPowerOfTwo(profile.column_segments) || profile.column_segments < 2 ||
      profile.column_segments > 16) {
    return OutOfRange("column segments", profile.column_segments, "2, 4, 8 or 16");
  }
  if (profile.segment_height_mm < 100 || profile.segment_height_mm > 4'000) {
    return OutOfRange("segment height in metres", profile.segment_height_m(), "0.1 to 4");
  }
  if (profile.column_base_offset_mm > 2'000) {
    return OutOfRange("column base offset in mm", profile.column_base_offset_mm, "0 to 2000");
  }
  return {};
}

Status ValidateFusion(const MapProfile& profile) {
  if (profile.sigma_base_mm < 10 || profile.sigma_base_mm > 1'000) {
    return OutOfRange("sigma base in mm", profile.sigma_base_mm, "10 to 1000");
  }
  if (profile.sigma_slope_ppm > 500'000) {
    return OutOfRange("sigma slope in ppm", profile.sigma_slope_ppm, "0 to 500000");
  }
  if (profile.preset > FusionPreset::kBounded) {
    return OutOfRange("preset", static_cast<int>(profile.preset), "0 to 2");
  }
  if (profile.overlap_permille != 600) {  // the one threshold that core/tile has a table for
    return OutOfRange("overlap threshold in permille", profile.overlap_permille, "600");
  }
  if (profile.same_layer_mm >= profile.other_layer_mm) {
    return OutOfRange("same-layer gate in mm", profile.same_layer_mm,
                      "less than the other-layer gate");
  }
  if (profile.hit_units <= 0 || profile.hit_units > 127) {
    return OutOfRange("hit evidence", profile.hit_units, "1 to 127");
  }
  if (profile.miss_units >= 0 || profile.miss_units < -127) {
    return OutOfRange("miss evidence", profile.miss_units, "-127 to -1");
  }
  if (profile.stretch_keyframes < 16 || profile.stretch_keyframes > 4'096) {
    return OutOfRange("keyframes per stretch", profile.stretch_keyframes, "16 to 4096");
  }
  if (profile.evidence_clamp < 64 || profile.evidence_clamp > 127) {
    return OutOfRange("evidence clamp", profile.evidence_clamp, "64 to 127");
  }
  if (profile.stretch_clamp < 64 || profile.stretch_clamp > profile.evidence_clamp) {
    return OutOfRange("stretch clamp", profile.stretch_clamp, "64 to the evidence clamp");
  }
  if (profile.carry_clamp < 0 || profile.carry_clamp > profile.evidence_clamp) {
    return OutOfRange("carry clamp", profile.carry_clamp, "0 to the evidence clamp");
  }
  if (profile.driven_clamp < profile.stretch_clamp || profile.driven_clamp > 127) {
    return OutOfRange("driven clamp", profile.driven_clamp, "the stretch clamp to 127");
  }
  if (profile.driven_hold_ms > 3'600'000) {
    return OutOfRange("hold where a vehicle drove, in ms,", profile.driven_hold_ms, "0 to 3600000");
  }
  return {};
}

// What the ranges of versions 1 and 2 allowed and today's do not, as near as today's come to it.
void BringIntoRange(MapProfile& profile) {
  profile.overlap_permille = 600;
  profile.evidence_clamp = std::max<std::int16_t>(profile.evidence_clamp, 64);
  profile.stretch_clamp =
      std::clamp<std::int16_t>(profile.stretch_clamp, 64, profile.evidence_clamp);
  profile.driven_clamp = std::clamp<std::int16_t>(profile.driven_clamp, profile.stretch_clamp, 127);
}

Status ValidateEarlier(const MapProfile& profile) {
  if (profile.overlap_permille < 100 || profile.overlap_permille > 950) {
    return OutOfRange("overlap threshold in permille", profile.overlap_permille, "100 to 950");
  }
  if (profile.stretch_clamp < 1 || profile.stretch_clamp > 127) {
    return OutOfRange("stretch clamp", profile.stretch_clamp, "1 to 127");
  }
  if (profile.evidence_clamp < 1 || profile.evidence_clamp > 127) {
    return OutOfRange("evidence clamp", profile.evidence_clamp, "1 to 127");
  }
  if (profile.driven_clamp < profile.stretch_clamp || profile.driven_clamp > 16'384) {
    return OutOfRange("driven clamp", profile.driven_clamp, "the stretch clamp to 16384");
  }
  return {};
}

Status ValidateBounded(const MapProfile& profile) {
  if (profile.band_mm < 500) {
    return OutOfRange("height of a band in mm", profile.band_mm, "500 to 65535");
  }
  if (profile.band_segments < 1) {
    return OutOfRange("segments of a band", profile.band_segments, "1 to 255");
  }
  if (profile.band_vehicle_segments < 1) {
    return OutOfRange("a vehicle's segments of a band", profile.band_vehicle_segments, "1 to 255");
  }
  return {};
}

void EncodeOrigin(const std::optional<GeodeticOrigin>& origin, ByteWriter& out) {
  out.U8(origin.has_value() ? 1 : 0);
  if (origin) {
    out.I64(origin->latitude_nanodeg);
    out.I64(origin->longitude_nanodeg);
    out.I64(origin->altitude_mm);
  }
}

std::optional<GeodeticOrigin> DecodeOrigin(ByteReader& in) {
  const std::uint8_t has_origin = in.U8();
  if (has_origin > 1) {
    in.Fail();  // equal profiles have equal bytes
  }
  if (has_origin == 0) {
    return std::nullopt;
  }
  GeodeticOrigin origin;
  origin.latitude_nanodeg = in.I64();
  origin.longitude_nanodeg = in.I64();
  origin.altitude_mm = in.I64();
  return origin;
}

// Version 1 got its driven_clamp before it got a number: the bytes behind evidence_clamp tell, of
// which the origin takes 1 or 25.
bool HasDrivenClamp(const ByteReader& in, std::uint8_t version) {
  return version >= 2 || in.remaining() % 24 == 3;
}

// Fields that the version lacks keep their defaults.
MapProfile ReadFields(ByteReader& in, std::uint8_t version) {
  MapProfile profile;
  profile.cell_size_um = in.U32();
  profile.tile_cells = in.U16();
  profile.levels = in.U8();
  profile.column_segments = in.U8();
  profile.segment_height_mm = in.U16();
  profile.column_base_offset_mm = in.U16();
  profile.vehicle_clearance_mm = in.U16();
  profile.sigma_slope_ppm = in.U32();
  profile.sigma_base_mm = in.U16();
  profile.sigma_interpolated_mm = in.U16();
  profile.sigma_extrapolated_mm = in.U16();
  profile.preset = static_cast<FusionPreset>(in.U8());
  profile.overlap_permille = in.U16();
  profile.same_layer_mm = in.U16();
  profile.other_layer_mm = in.U16();
  profile.layer_span_mm = in.U16();
  profile.slab_margin_mm = in.U16();
  if (version >= 2) {
    profile.stretch_keyframes = in.U16();
  }
  profile.sequence_gap = in.U16();
  if (version >= 2) {
    profile.band_mm = in.U16();
    profile.band_segments = in.U8();
    profile.band_vehicle_segments = in.U8();
  }
  profile.hit_units = in.I16();
  profile.miss_units = in.I16();
  profile.stretch_clamp = in.I16();
  profile.evidence_clamp = in.I16();
  if (version >= 2) {
    profile.carry_clamp = in.I16();
  }
  if (HasDrivenClamp(in, version)) {
    profile.driven_clamp = in.I16();
  }
  if (version >= 3) {
    profile.driven_hold_ms = in.U32();
  }
  profile.origin = DecodeOrigin(in);
  return profile;
}

}  // namespace

std::string_view FusionPresetName(FusionPreset preset) {
  return kPresetNames[static_cast<std::size_t>(preset)];
}

std::optional<FusionPreset> FusionPresetByName(std::string_view name) {
  const auto found = std::find(kPresetNames.begin(), kPresetNames.end(), name);
  if (found == kPresetNames.end()) {
    return std::nullopt;
  }
  return static_cast<FusionPreset>(found - kPresetNames.begin());
}

Status MapProfile::Validate() const {
  ATLAS_RETURN_IF_ERROR(ValidateGrid(*this));
  ATLAS_RETURN_IF_ERROR(ValidateFusion(*this));
  return ValidateBounded(*this);
}

Bytes MapProfile::Encode() const {
  if (!earlier_encoding.empty()) {
    return earlier_encoding;
  }
  ByteWriter out;
  out.U8(kProfileVersion);
  out.U32(cell_size_um);
  out.U16(tile_cells);
  out.U8(levels);
  out.U8(column_segments);
  out.U16(segment_height_mm);
  out.U16(column_base_offset_mm);
  out.U16(vehicle_clearance_mm);
  out.U32(sigma_slope_ppm);
  out.U16(sigma_base_mm);
  out.U16(sigma_interpolated_mm);
  out.U16(sigma_extrapolated_mm);
  out.U8(static_cast<std::uint8_t>(preset));
  out.U16(overlap_permille);
  out.U16(same_layer_mm);
  out.U16(other_layer_mm);
  out.U16(layer_span_mm);
  out.U16(slab_margin_mm);
  out.U16(stretch_keyframes);
  out.U16(sequence_gap);
  out.U16(band_mm);
  out.U8(band_segments);
  out.U8(band_vehicle_segments);
  out.I16(hit_units);
  out.I16(miss_units);
  out.I16(stretch_clamp);
  out.I16(evidence_clamp);
  out.I16(carry_clamp);
  out.I16(driven_clamp);
  out.U32(driven_hold_ms);
  EncodeOrigin(origin, out);
  return out.Take();
}

Result<MapProfile> MapProfile::Decode(ByteSpan bytes) {
  ByteReader in(bytes);
  const std::uint8_t version = in.U8();
  if (version < 1 || version > kProfileVersion) {
    return Error(StatusCode::kUnsupported,
                 StrCat("map profile: version ", int{version}, ", this build reads 1 to ",
                        int{kProfileVersion}));
  }
  MapProfile profile = ReadFields(in, version);
  if (!in.ok() || in.remaining() != 0) {
    return Error(StatusCode::kInvalidData,
                 "map profile: truncated, has trailing bytes or a has_origin above 1");
  }
  if (version < kProfileVersion) {
    if (Status status = ValidateEarlier(profile); !status.ok()) {
      return Error(StatusCode::kInvalidData, status.message());
    }
    BringIntoRange(profile);
    profile.earlier_encoding.assign(bytes.begin(), bytes.end());
  }
  if (Status status = profile.Validate(); !status.ok()) {
    return Error(StatusCode::kInvalidData, status.message());
  }
  return profile;
}

std::uint64_t MapProfile::Hash() const {
  return Hash64(Encode());
}

}  // namespace atlas
