#include "client/cli/files/change_file.h"

#include <string_view>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "client/cli/output/json_text.h"
#include "client/cli/output/text_table.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr std::string_view kColumns =
    "kind,vehicle,session,x_m,y_m,low_m,high_m,min_x_m,min_y_m,max_x_m,max_y_m,cells,segments\n";

std::string CsvLine(const MapChange& change) {
  std::string line =
      StrCat(ChangeKindName(change.kind), ",", change.seen_by.vehicle, ",", change.seen_by.session);
  for (const double metres :
       {change.center_m.x(), change.center_m.y(), change.low_m, change.high_m, change.min_m.x(),
        change.min_m.y(), change.max_m.x(), change.max_m.y()}) {
    line += ',' + FixedText(metres, 2);
  }
  return StrCat(line, ",", change.cells.size(), ",", change.segments, "\n");
}

boost::json::object Feature(const MapChange& change) {
  const auto corner = [](double x_m, double y_m) {
    return boost::json::array{Rounded(x_m, 2), Rounded(y_m, 2)};
  };
  const Eigen::Vector2d& low = change.min_m;
  const Eigen::Vector2d& high = change.max_m;
  const boost::json::array ring{corner(low.x(), low.y()), corner(high.x(), low.y()),
                                corner(high.x(), high.y()), corner(low.x(), high.y()),
                                corner(low.x(), low.y())};
  return {{"type", "Feature"},
          {"geometry", {{"type", "Polygon"}, {"coordinates", boost::json::array{ring}}}},
          {"properties",
           {{"kind", ChangeKindName(change.kind)},
            {"vehicle", change.seen_by.vehicle},
            {"session", change.seen_by.session},
            {"low_m", Rounded(change.low_m, 2)},
            {"high_m", Rounded(change.high_m, 2)},
            {"cells", change.cells.size()},
            {"segments", change.segments}}}};
}

}  // namespace

Result<ChangeFormat> ChangeFormatOf(const std::string& file) {
  if (file.ends_with(".csv")) return ChangeFormat::kCsv;
  if (file.ends_with(".geojson") || file.ends_with(".json")) return ChangeFormat::kGeoJson;
  return Error(StatusCode::kInvalidArgument,
               StrCat(file, ": expected a name that ends in .csv, .geojson or .json"));
}

std::string ChangeText(ChangeFormat format, std::span<const MapChange> changes) {
  if (format == ChangeFormat::kCsv) {
    std::string text(kColumns);
    for (const MapChange& change : changes) text += CsvLine(change);
    return text;
  }
  std::string text = R"({"type":"FeatureCollection","features":[)";
  std::string_view separator = "\n";
  for (const MapChange& change : changes) {
    text += separator;
    text += JsonText(Feature(change));
    separator = ",\n";
  }
  return text + "\n]}\n";
}

}  // namespace atlas
