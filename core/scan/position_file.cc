#include "core/scan/position_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <string_view>
#include <vector>

#include "core/base/str_cat.h"
#include "core/scan/text_lines.h"

namespace atlas {
namespace {

constexpr double kMaxAway_m = 1e7;
constexpr double kMinRadius_m = 1e-3;
constexpr double kMaxRadius_m = 1e5;

bool IsSkipped(std::string_view line) {
  const std::size_t first = line.find_first_not_of(" \t");
  return first == std::string_view::npos || line[first] == '#';
}

// None: there is no such scan.
std::optional<std::uint32_t> ScanOf(double number, const DriveFolder& drive) {
  const auto scan = std::lower_bound(
      drive.scans.begin(), drive.scans.end(), number,
      [](const DriveScan& one, double n) { return static_cast<double>(one.number) < n; });
  const bool is_there = scan != drive.scans.end() && static_cast<double>(scan->number) == number;
  return is_there ? std::optional(scan->number) : std::nullopt;
}

Result<KnownPlace> PlaceOf(const std::vector<double>& numbers) {
  KnownPlace place;
  place.p_world = Eigen::Vector3d(numbers[1], numbers[2], numbers[3]);
  place.radius_m = numbers[4];
  // Not a number is neither within nor beyond.
  if (!(place.p_world.cwiseAbs().maxCoeff() <= kMaxAway_m) || !place.p_world.allFinite()) {
    return Error(StatusCode::kInvalidData,
                 StrCat("position ", place.p_world.transpose(), " m: expected within 10,000 km"));
  }
  if (!(place.radius_m >= kMinRadius_m && place.radius_m <= kMaxRadius_m)) {
    return Error(StatusCode::kInvalidData,
                 StrCat("radius ", place.radius_m, " m: expected 0.001 to 100,000"));
  }
  return place;
}

Status AddLine(std::string_view line, const DriveFolder& drive, KnownPlaces& places) {
  const auto numbers = ParseNumbers(line);
  if (!numbers || numbers->size() != 5) {
    return {StatusCode::kInvalidData, "expected five numbers: scan x y z radius"};
  }
  const auto scan = ScanOf(numbers->front(), drive);
  if (!scan) {
    return {StatusCode::kInvalidData, StrCat("the drive has no scan ", numbers->front())};
  }
  const Result<KnownPlace> place = PlaceOf(*numbers);
  if (!place) return place.error();
  if (!places.emplace(*scan, *place).second) {
    return {StatusCode::kInvalidData, StrCat("scan ", *scan, " has a position already")};
  }
  return {};
}

}  // namespace

Result<KnownPlaces> ReadPositions(const std::filesystem::path& path, const DriveFolder& drive) {
  const auto lines = ReadLines(path);
  if (!lines) return Error(lines.error());
  KnownPlaces places;
  for (std::size_t i = 0; i < lines->size(); ++i) {
    if (IsSkipped((*lines)[i])) continue;
    const Status status = AddLine((*lines)[i], drive, places);
    if (!status.ok()) {
      return Error(status.WithContext(StrCat(path.string(), ": line ", i + 1)));
    }
  }
  if (places.empty()) {
    return Error(StatusCode::kInvalidData, StrCat(path.string(), ": no position in it"));
  }
  return places;
}

std::string PositionFileText(const KnownPlaces& places) {
  std::string text = "# scan x y z radius: of the sensor in the world, metres\n";
  for (const auto& [scan, place] : places) {
    text += std::to_string(scan);
    for (const double value :
         {place.p_world.x(), place.p_world.y(), place.p_world.z(), place.radius_m}) {
      std::array<char, 64> digits{};
      const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                     std::chars_format::fixed, 4);
      text.append(" ").append(digits.data(), end.ptr);
    }
    text += "\n";
  }
  return text;
}

}  // namespace atlas
