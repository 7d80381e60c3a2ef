// Where scans were found each alone, as text that other programs read.
#pragma once

#include <span>
#include <string>

#include "client/drive/drive_relocalization.h"

namespace atlas {

// CSV: a line a scan, the first names the columns, which are those of a track (track_file.h) where
// they have the same name. `health` is good where the scan was found and lost where the answer is
// "don't know", with an empty pose; errors, fit and explained are those of the likeliest place
// then, and empty where there was none.
std::string RelocalizationText(std::span<const RelocalizedScan> scans);

}  // namespace atlas
