// Which scans of a recorded drive are used, and which session each belongs to.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/scan/drive_folder.h"

namespace atlas {

enum class ScanParity { kAll, kEven, kOdd };  // of the file's number

// "even", "odd", "all".
Result<ScanParity> ParseScanParity(const std::string& text);

struct SelectionOptions {
  ScanParity parity = ScanParity::kAll;
  std::uint32_t begin = 0;  // half-open range of file numbers
  std::uint32_t end = UINT32_MAX;
  double every_m = 0.0;  // from the last kept pose; 0 keeps all
};

struct SelectedScan {
  std::size_t index = 0;           // into DriveFolder::scans
  std::uint32_t session_part = 1;  // 2 and up after a jump
};

// A step between neighbouring scans of the folder above this starts another part.
inline constexpr double kSessionJump_m = 10.0;
double Distance(const DriveScan& from, const DriveScan& to);  // in metres
bool IsJump(const DriveScan& from, const DriveScan& to);

std::vector<SelectedScan> SelectScans(const DriveFolder& drive, const SelectionOptions& options);

// "S", "S.2", "S.3", ...
std::string SessionPartName(const std::string& session, std::uint32_t part);

// Distance driven from one to the next, jumps left out.
double SelectedMetres(const DriveFolder& drive, const std::vector<SelectedScan>& selected);

// The same order for the same seed, everywhere.
void ShuffleScans(std::vector<SelectedScan>& selected, std::uint64_t seed);

}  // namespace atlas
