// Two formats, one list of points.
#include "client/cli/files/route_file.h"

#include <algorithm>
#include <sstream>
#include <utility>

#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>

#include "client/cli/files/whole_file.h"
#include "client/cli/output/text_table.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

using Points = std::vector<Eigen::Vector3d>;

// A million waypoints and more.
constexpr std::uint64_t kMaxBytes = std::uint64_t{256} << 20;

std::optional<Points> ParsePositions(const boost::json::value& line) {
  if (!line.is_array()) return std::nullopt;
  Points points;
  for (const boost::json::value& position : line.get_array()) {
    if (!position.is_array() || position.get_array().size() < 3) return std::nullopt;
    Eigen::Vector3d p;
    for (std::size_t i = 0; i < 3; ++i) {
      boost::system::error_code no_number;
      p[static_cast<Eigen::Index>(i)] = position.get_array()[i].to_number<double>(no_number);
      if (no_number) return std::nullopt;
    }
    points.push_back(p);
  }
  return points;
}

// Foreign members of GeoJSON may be anything: none that is not ours.
std::optional<RouteAtlas> ParseAtlas(const boost::json::value& root) {
  boost::system::error_code error;
  const boost::json::value* id = root.find_pointer("/atlas/id", error);
  const boost::json::value* profile = root.find_pointer("/atlas/profile", error);
  if (id == nullptr || profile == nullptr || !id->is_string() || !profile->is_string()) {
    return std::nullopt;
  }
  return RouteAtlas{std::string(id->get_string()), std::string(profile->get_string())};
}

// Nothing where the text is no route.
std::optional<RouteFile> ParseGeoJson(const std::string& text) {
  boost::system::error_code error;
  const boost::json::value root = boost::json::parse(text, error);
  if (error) return std::nullopt;
  const boost::json::value* line = root.find_pointer("/geometry/coordinates", error);
  if (line == nullptr) return std::nullopt;
  // A route that ends where it begins is a Point (RFC 7946, 3.1.2), all others are a LineString.
  const boost::json::value* type = root.find_pointer("/geometry/type", error);
  const bool is_point = type != nullptr && *type == "Point";
  auto points = is_point ? ParsePositions(boost::json::array{*line}) : ParsePositions(*line);
  if (!points) return std::nullopt;
  return RouteFile{*std::move(points), ParseAtlas(root)};
}

// Lines before the columns' names may be comments.
std::optional<RouteFile> ParseCsv(const std::string& text) {
  std::istringstream lines(text);
  std::string line;
  if (!std::getline(lines, line) || !line.starts_with("x_m,y_m,z_m")) return std::nullopt;
  Points points;
  while (std::getline(lines, line)) {
    std::istringstream fields(line);
    Eigen::Vector3d p;
    char comma = ',';
    if (!(fields >> p.x() >> comma >> p.y() >> comma >> p.z()) || comma != ',') return std::nullopt;
    points.push_back(p);
  }
  return RouteFile{std::move(points), std::nullopt};
}

}  // namespace

RouteAtlas RouteAtlasOf(ByteSpan atlas_id, const MapProfile& profile) {
  ByteWriter hash;
  hash.U64(profile.Hash());
  Bytes bytes = hash.Take();
  std::reverse(bytes.begin(), bytes.end());  // as a number is written
  return {HexText(atlas_id), HexText(bytes)};
}

boost::json::object RouteAtlasJson(const RouteAtlas& atlas) {
  return {{"id", atlas.id}, {"profile", atlas.profile}};
}

Result<RouteFile> ReadRoute(const std::filesystem::path& file) {
  const auto text = ReadWholeFile(file, kMaxBytes);
  if (!text) return Error(text.error());
  auto route = file.extension() == ".csv" ? ParseCsv(*text) : ParseGeoJson(*text);
  const bool is_route = route && !route->waypoints.empty() &&
                        std::all_of(route->waypoints.begin(), route->waypoints.end(),
                                    [](const Eigen::Vector3d& p) { return p.allFinite(); });
  if (!is_route) {
    return Error(StatusCode::kInvalidData,
                 StrCat(file.string(), ": no route, expected what `atlas plan --output` writes"));
  }
  return *std::move(route);
}

}  // namespace atlas
