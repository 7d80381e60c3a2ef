// When the scans of a recorded drive were made.
#pragma once

#include <optional>
#include <vector>

#include "client/drive/drive_selection.h"
#include "core/scan/drive_folder.h"

namespace atlas {

// Whether the drive says of all of them when they were made.
bool IsTimed(const DriveFolder& drive, const std::vector<SelectedScan>& selected);

// For a ScanClock, of each of `selected`: in seconds, or as they are numbered where the drive is
// not timed, so that what is missing counts. A single time that does not go on between its
// neighbours' is taken between them as the scan is numbered; none, where it has but one. Where a
// clock was set back times go back.
std::vector<std::optional<double>> TimesOf(const DriveFolder& drive,
                                           const std::vector<SelectedScan>& selected);

// From one scan to the next, as a rule; none of fewer than two.
std::optional<double> UsualIntervalOf(const std::vector<std::optional<double>>& times);

}  // namespace atlas
