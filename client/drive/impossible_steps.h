// Steps of a recorded drive that no vehicle does: they stay in their session, for the daemon to
// judge (core/geometry/plausibility.h, its default limits).
#pragma once

#include <string>
#include <vector>

#include "client/drive/drive_selection.h"
#include "core/scan/drive_folder.h"

namespace atlas {

// In seconds of the drive's own clock; ten scans a second where there is no times.txt.
double ScanTime_s(const DriveScan& scan);

// Makes parts that an impossible step separates one session. Where there is no times.txt the parts
// stay, but for a few scans away after which the drive goes on where it was: wild poses. `selected`
// as SelectScans returned it.
void JoinImpossibleParts(const DriveFolder& drive, std::vector<SelectedScan>& selected);

// Why the daemon keeps sessions of these out of the map, in the words of ImplausibleWay; a scan's
// number is its keyframe's. Ways have no step in common.
std::vector<std::string> FindImpossibleSteps(const DriveFolder& drive,
                                             const std::vector<SelectedScan>& selected);

}  // namespace atlas
