// What the map has of the ground that a scan saw.
#pragma once

#include <cstdint>
#include <string_view>

#include "core/geometry/pose.h"
#include "core/localization/registration/scan_features.h"
#include "core/localization/window/map_window.h"

namespace atlas {

enum class MapCover : std::uint8_t {
  kNone,    // (nearly) nothing: it was never mapped, or its tiles have not arrived
  kCoarse,  // most of it from tiles above level 0: the finer ones have not arrived
  kFine,
};
std::string_view MapCoverName(MapCover cover);

struct CoverAtScan {
  MapCover map = MapCover::kNone;
  double cell_m = 0.0;  // of what was mapped, on average
};

// `cell_size_m`: of level 0.
CoverAtScan CoverAt(const MapWindow& map,
                    const ScanFeatures& features,
                    const Pose& T_world_level,
                    double cell_size_m);

}  // namespace atlas
