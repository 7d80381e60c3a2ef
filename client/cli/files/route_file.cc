// Two formats, one list of points.
#include "client/cli/files/route_file.h"

#include <array>
#include <cmath>
#include <sstream>

#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>

#include "client/cli/files/whole_file.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

using Points = std::vector<Eigen::Vector3d>;

// A million waypoints and more.
constexpr std::uint64_t kMaxBytes = std::uint64_t{256} << 20;

// Nothing where the text is no route.
std::optional<Points> ParseGeoJson(const std::string& text) {
  boost::system::error_code error;
  const boost::json::value root = boost::json::parse(text, error);
  if (error) return std::nullopt;
  const boost::json::value* line = root.find_pointer("/geometry/coordinates", error);
  if (line == nullptr || !line->is_array()) return std::nullopt;
  Points points;
  for (const boost::json::value& position : line->get_array()) {
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

std::optional<Points> ParseCsv(const std::string& text) {
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
  return points;
}

}  // namespace

Result<Points> ReadRoute(const std::filesystem::path& file) {
  const auto text = ReadWholeFile(file, kMaxBytes);
  if (!text) return Error(text.error());
  auto points = file.extension() == ".csv" ? ParseCsv(*text) : ParseGeoJson(*text);
  bool is_route = points.has_value() && !points->empty();
  for (std::size_t i = 0; is_route && i < points->size(); ++i) {
    is_route = (*points)[i].allFinite();
  }
  if (!is_route) {
    return Error(StatusCode::kInvalidData,
                 StrCat(file.string(), ": no route, expected what `atlas plan --output` writes"));
  }
  return *std::move(points);
}

}  // namespace atlas
