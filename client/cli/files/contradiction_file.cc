#include "client/cli/files/contradiction_file.h"

#include <algorithm>
#include <optional>
#include <sstream>

#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>

#include "client/cli/files/whole_file.h"
#include "client/cli/output/json_text.h"
#include "client/cli/output/text_table.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

using Places = std::vector<ContradictionPlace>;

constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 30;
constexpr std::string_view kColumns =
    "kind,x_m,y_m,layer_m,low_m,high_m,hits,passes,first_scan,last_scan,score\n";

double Middle(std::int64_t cell, double cell_size_m) {
  return (static_cast<double>(cell) + 0.5) * cell_size_m;
}

std::string CsvLine(const Contradiction& c, double cell_size_m) {
  std::string line(ContradictionKindName(c.kind));
  for (const double value : {Middle(c.cell_x, cell_size_m), Middle(c.cell_y, cell_size_m),
                             c.altitude_mm * 1e-3, c.low_mm * 1e-3, c.high_mm * 1e-3}) {
    line += ',' + FixedText(value, 3);
  }
  for (const std::uint32_t count : {c.hits, c.passes, c.first_scan, c.last_scan}) {
    line += ',' + std::to_string(count);
  }
  return line + ',' + FixedText(c.score, 2) + '\n';
}

boost::json::object Feature(const Contradiction& c, double cell_size_m) {
  const boost::json::array place{Rounded(Middle(c.cell_x, cell_size_m), 3),
                                 Rounded(Middle(c.cell_y, cell_size_m), 3),
                                 Rounded(c.low_mm * 1e-3, 3)};
  return {{"type", "Feature"},
          {"geometry", {{"type", "Point"}, {"coordinates", place}}},
          {"properties",
           {{"kind", ContradictionKindName(c.kind)},
            {"layer_m", Rounded(c.altitude_mm * 1e-3, 3)},
            {"low_m", Rounded(c.low_mm * 1e-3, 3)},
            {"high_m", Rounded(c.high_mm * 1e-3, 3)},
            {"hits", c.hits},
            {"passes", c.passes},
            {"first_scan", c.first_scan},
            {"last_scan", c.last_scan},
            {"score", Rounded(c.score, 2)}}}};
}

std::optional<ContradictionKind> KindNamed(std::string_view name) {
  for (const ContradictionKind kind :
       {ContradictionKind::kAppeared, ContradictionKind::kVanished, ContradictionKind::kMoving}) {
    if (name == ContradictionKindName(kind)) return kind;
  }
  return std::nullopt;
}

// Nothing where the text is no such list.
std::optional<Places> ParseCsv(const std::string& text) {
  std::istringstream lines(text);
  std::string line;
  if (!std::getline(lines, line) || line + '\n' != kColumns) return std::nullopt;
  Places places;
  while (std::getline(lines, line)) {
    std::istringstream fields(line);
    std::string name;
    char comma = ',';
    Eigen::Vector2d p;
    if (!std::getline(fields, name, ',') || !(fields >> p.x() >> comma >> p.y())) {
      return std::nullopt;
    }
    const auto kind = KindNamed(name);
    if (!kind) return std::nullopt;
    places.push_back({*kind, p});
  }
  return places;
}

std::optional<ContradictionPlace> ParseFeature(const boost::json::value& feature) {
  boost::system::error_code error;
  const boost::json::value* name = feature.find_pointer("/properties/kind", error);
  if (error || !name->is_string()) return std::nullopt;
  const auto kind = KindNamed(name->get_string());
  if (!kind) return std::nullopt;
  ContradictionPlace place{*kind, {}};
  for (const Eigen::Index axis : {0, 1}) {
    const boost::json::value* number = feature.find_pointer(
        axis == 0 ? "/geometry/coordinates/0" : "/geometry/coordinates/1", error);
    if (error) return std::nullopt;
    place.center_m[axis] = number->to_number<double>(error);
    if (error) return std::nullopt;
  }
  return place;
}

std::optional<Places> ParseGeoJson(const std::string& text) {
  boost::system::error_code error;
  const boost::json::value root = boost::json::parse(text, error);
  if (error) return std::nullopt;
  const boost::json::value* features = root.find_pointer("/features", error);
  if (error || !features->is_array()) return std::nullopt;
  Places places;
  for (const boost::json::value& feature : features->get_array()) {
    const auto place = ParseFeature(feature);
    if (!place) return std::nullopt;
    places.push_back(*place);
  }
  return places;
}

}  // namespace

Result<ContradictionFormat> ContradictionFormatOf(const std::string& file) {
  if (file.ends_with(".csv")) return ContradictionFormat::kCsv;
  if (file.ends_with(".geojson") || file.ends_with(".json")) return ContradictionFormat::kGeoJson;
  return Error(StatusCode::kInvalidArgument,
               StrCat(file, ": expected a name that ends in .csv, .geojson or .json"));
}

std::string ContradictionText(ContradictionFormat format,
                              std::span<const Contradiction> contradictions,
                              double cell_size_m) {
  if (format == ContradictionFormat::kCsv) {
    std::string text(kColumns);
    for (const Contradiction& c : contradictions) text += CsvLine(c, cell_size_m);
    return text;
  }
  std::string text = R"({"type":"FeatureCollection","features":[)";
  std::string_view separator = "\n";
  for (const Contradiction& c : contradictions) {
    text += separator;
    text += JsonText(Feature(c, cell_size_m));
    separator = ",\n";
  }
  return text + "\n]}\n";
}

Result<Places> ReadContradictions(const std::filesystem::path& file) {
  const auto format = ContradictionFormatOf(file.string());
  if (!format) return Error(format.error());
  const auto text = ReadWholeFile(file, kMaxBytes);
  if (!text) return Error(text.error());
  auto places = *format == ContradictionFormat::kCsv ? ParseCsv(*text) : ParseGeoJson(*text);
  const bool is_list = places && std::all_of(places->begin(), places->end(), [](const auto& place) {
                         return place.center_m.allFinite();
                       });
  if (!is_list) {
    return Error(StatusCode::kInvalidData,
                 StrCat(file.string(),
                        ": no contradictions, expected what `atlas localize --contradictions` "
                        "writes"));
  }
  return *std::move(places);
}

}  // namespace atlas
