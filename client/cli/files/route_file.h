// Routes that `atlas plan --output` wrote.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <boost/json/object.hpp>

#include "core/base/bytes.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"

namespace atlas {

// Names the atlas that a route was planned in, as the file does: hexadecimal.
struct RouteAtlas {
  std::string id;
  std::string profile;  // its hash (docs/formats/profile.md)

  friend bool operator==(const RouteAtlas&, const RouteAtlas&) = default;
};
RouteAtlas RouteAtlasOf(ByteSpan atlas_id, const MapProfile& profile);
boost::json::object RouteAtlasJson(const RouteAtlas& atlas);

struct RouteFile {
  std::vector<Eigen::Vector3d> waypoints;  // in order; metres, map frame
  std::optional<RouteAtlas> atlas;         // of GeoJSON that says it
};

// A GeoJSON Feature's LineString or a CSV file, by the file's ending. kInvalidData: no such
// content, or a number that is not finite; else as of ReadWholeFile.
Result<RouteFile> ReadRoute(const std::filesystem::path& file);

}  // namespace atlas
