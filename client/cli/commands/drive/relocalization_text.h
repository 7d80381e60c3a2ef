// What relocalized scans look like to a user.
#pragma once

#include <ostream>

#include <boost/json/object.hpp>

#include "client/drive/drive_relocalization.h"
#include "core/base/status.h"

namespace atlas {

// A line of the stream: `pose` is null and `health` lost where the answer is "don't know"; the
// error is that of what was likeliest.
boost::json::object RelocalizedScanJson(const RelocalizedScan& scan);
boost::json::object RelocalizationJson(const DriveRelocalizationReport& report);
void PrintRelocalization(const DriveRelocalizationReport& report, std::ostream& out);
// Scans that could not be read, in the words of the first of them.
Status CheckReadable(const DriveRelocalizationReport& report);
// Where nothing was found of any scan: what that may mean.
void NoteUnknown(const DriveRelocalizationReport& report, std::ostream& err);

}  // namespace atlas
