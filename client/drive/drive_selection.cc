#include "client/drive/drive_selection.h"

#include <utility>

#include "core/base/hash_random.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

bool IsWanted(std::uint32_t number, const SelectionOptions& options) {
  if (number < options.begin || number >= options.end) return false;
  switch (options.parity) {
    case ScanParity::kAll:
      return true;
    case ScanParity::kEven:
      return number % 2 == 0;
    case ScanParity::kOdd:
      return number % 2 == 1;
  }
  return false;
}

}  // namespace

Result<ScanParity> ParseScanParity(const std::string& text) {
  if (text == "all") return ScanParity::kAll;
  if (text == "even") return ScanParity::kEven;
  if (text == "odd") return ScanParity::kOdd;
  return Error(StatusCode::kInvalidArgument,
               StrCat("scans '", text.substr(0, 80), "': expected even, odd or all"));
}

double Distance(const DriveScan& from, const DriveScan& to) {
  return (from.T_world_sensor.translation() - to.T_world_sensor.translation()).norm();
}

bool IsJump(const DriveScan& from, const DriveScan& to) {
  return Distance(from, to) > kSessionJump_m;
}

std::vector<SelectedScan> SelectScans(const DriveFolder& drive, const SelectionOptions& options) {
  std::vector<SelectedScan> selected;
  std::uint32_t part = 1;
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    const DriveScan& scan = drive.scans[i];
    if (i > 0 && IsJump(drive.scans[i - 1], scan)) ++part;
    if (!IsWanted(scan.number, options)) continue;
    const bool is_first = selected.empty() || selected.back().session_part != part;
    if (is_first || Distance(drive.scans[selected.back().index], scan) >= options.every_m) {
      selected.push_back({i, part});
    }
  }
  return selected;
}

std::string SessionPartName(const std::string& session, std::uint32_t part) {
  return part == 1 ? session : StrCat(session, '.', part);
}

double SelectedMetres(const DriveFolder& drive, const std::vector<SelectedScan>& selected) {
  double metres = 0.0;
  for (std::size_t i = 1; i < selected.size(); ++i) {
    if (selected[i].session_part != selected[i - 1].session_part) continue;
    metres += Distance(drive.scans[selected[i - 1].index], drive.scans[selected[i].index]);
  }
  return metres;
}

void ShuffleScans(std::vector<SelectedScan>& selected, std::uint64_t seed) {
  HashRandom random(seed);
  for (std::size_t i = selected.size(); i > 1; --i) {
    std::swap(selected[i - 1], selected[random.Next() % i]);
  }
}

}  // namespace atlas
