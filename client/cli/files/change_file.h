// What changed in the map, as text that other programs read.
#pragma once

#include <span>
#include <string>

#include "client/merge/changes/map_change.h"
#include "core/base/status.h"

namespace atlas {

enum class ChangeFormat {
  kCsv,      // a line each; the first line names the columns
  kGeoJson,  // a FeatureCollection, a Polygon each: the box around it
};

// By the name's ending, .csv, or .geojson or .json; else kInvalidArgument.
Result<ChangeFormat> ChangeFormatOf(const std::string& file);

// Metres of the map's frame.
std::string ChangeText(ChangeFormat format, std::span<const MapChange> changes);

}  // namespace atlas
