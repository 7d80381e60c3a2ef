#include "core/scan/drive_folder.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <system_error>

#include "core/base/str_cat.h"
#include "core/scan/text_lines.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxScans = 10'000'000;

Result<std::vector<double>> ReadTimes(const fs::path& path) {
  Result<std::vector<std::string>> lines = ReadLines(path);
  if (!lines) {
    return Error(lines.error());
  }
  std::vector<double> times;
  for (const std::string& line : *lines) {
    const auto numbers = ParseNumbers(line);
    if (!numbers || numbers->size() != 1 || !std::isfinite(numbers->front())) {
      return Error(StatusCode::kInvalidData, StrCat(path.string(), ": line ", times.size() + 1,
                                                    ": expected one time in seconds"));
    }
    times.push_back(numbers->front());
  }
  return times;
}

// The number in "000123.bin".
std::optional<std::uint32_t> ScanNumber(const fs::path& path) {
  const std::string stem = path.stem().string();
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
  if (path.extension() != ".bin" || error != std::errc() || end != stem.data() + stem.size()) {
    return std::nullopt;
  }
  return number;
}

Status CheckNumbers(const fs::path& velodyne, const std::vector<DriveScan>& sorted) {
  if (sorted.empty()) {
    return {StatusCode::kInvalidData, StrCat(velodyne.string(), ": no NNNNNN.bin in it")};
  }
  const auto twice = std::adjacent_find(
      sorted.begin(), sorted.end(),
      [](const DriveScan& a, const DriveScan& b) { return a.number == b.number; });
  return twice == sorted.end()
             ? Status()
             : Status(StatusCode::kInvalidData,
                      StrCat(velodyne.string(), ": two scans have the number ", twice->number));
}

Result<std::vector<DriveScan>> ListScans(const fs::path& folder) {
  const fs::path velodyne = folder / "velodyne";
  std::vector<DriveScan> scans;
  std::error_code error;
  for (fs::directory_iterator it(velodyne, error), end; !error && it != end; it.increment(error)) {
    const auto number = ScanNumber(it->path());
    if (number && scans.size() < kMaxScans) {
      scans.push_back({*number, it->path(), std::nullopt, Pose::Identity(), std::nullopt});
    }
  }
  if (error) {
    const bool is_forbidden = error == std::errc::permission_denied;
    return Error(is_forbidden ? StatusCode::kPermissionDenied : StatusCode::kNotFound,
                 StrCat(velodyne.string(), ": ", error.message()));
  }
  std::sort(scans.begin(), scans.end(),
            [](const DriveScan& a, const DriveScan& b) { return a.number < b.number; });
  if (Status status = CheckNumbers(velodyne, scans); !status.ok()) {
    return Error(std::move(status));
  }
  return scans;
}

Status AttachTimes(const fs::path& folder, std::vector<DriveScan>& scans) {
  std::error_code error;
  if (!fs::exists(folder / "times.txt", error)) {
    return {};
  }
  Result<std::vector<double>> times = ReadTimes(folder / "times.txt");
  if (!times) {
    return times.error();
  }
  for (DriveScan& scan : scans) {
    if (scan.number >= times->size()) {
      return Status(StatusCode::kInvalidData,
                    StrCat((folder / "times.txt").string(), ": ", times->size(),
                           " lines, but there is a scan ", scan.number));
    }
    scan.time_s = (*times)[scan.number];
  }
  return {};
}

void AttachLabels(const fs::path& folder, std::vector<DriveScan>& scans) {
  for (DriveScan& scan : scans) {
    fs::path label = folder / "labels" / scan.scan.stem();
    label += ".label";
    std::error_code error;
    if (fs::exists(label, error)) {
      scan.label = label;
    }
  }
}

}  // namespace

Result<std::vector<Pose>> ReadPoses(const fs::path& path) {
  Result<std::vector<std::string>> lines = ReadLines(path);
  if (!lines) {
    return Error(lines.error());
  }
  std::vector<Pose> poses;
  for (const std::string& line : *lines) {
    const std::string where = StrCat(path.string(), ": line ", poses.size() + 1);
    const auto numbers = ParseNumbers(line);
    if (!numbers || numbers->size() != 12) {
      return Error(StatusCode::kInvalidData, StrCat(where, ": expected 12 numbers"));
    }
    std::array<double, 12> values{};
    std::copy(numbers->begin(), numbers->end(), values.begin());
    Result<Pose> pose = PoseFromRowMajor(values);
    if (!pose) {
      return Error(pose.error().WithContext(where));
    }
    poses.push_back(*pose);
  }
  return poses;
}

Result<DriveFolder> OpenDriveFolder(const fs::path& path) {
  Result<std::vector<DriveScan>> scans = ListScans(path);
  if (!scans) {
    return Error(scans.error());
  }
  Result<std::vector<Pose>> poses = ReadPoses(path / "poses.txt");
  if (!poses) {
    return Error(poses.error());
  }
  for (DriveScan& scan : *scans) {
    if (scan.number >= poses->size()) {
      return Error(StatusCode::kInvalidData,
                   StrCat((path / "poses.txt").string(), ": ", poses->size(),
                          " lines, but there is a scan ", scan.number));
    }
    scan.T_world_sensor = (*poses)[scan.number];
  }
  if (Status status = AttachTimes(path, *scans); !status.ok()) {
    return Error(std::move(status));
  }
  AttachLabels(path, *scans);
  return DriveFolder{path, std::move(*scans)};
}

}  // namespace atlas
