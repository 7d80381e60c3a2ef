// What the localizer said of itself along a drive, as a strip of a plot.
#pragma once

#include <span>

#include "client/drive/drive_localization.h"
#include "client/render/plot/line_plot.h"

namespace atlas {

// States by LocalizationHealth: good, weak, lost. A part reaches half way to the scans beside it;
// scans in a row of the same health are one.
PlotStrip HealthStrip(std::span<const LocalizedScan> scans);

}  // namespace atlas
