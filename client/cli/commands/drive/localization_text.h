// What localized scans look like to a user.
#pragma once

#include <cstdint>
#include <ostream>

#include <boost/json/object.hpp>

#include "client/drive/drive_localization.h"
#include "core/base/status.h"

namespace atlas {

// A line of the stream.
boost::json::object LocalizedScanJson(const LocalizedScan& scan);
boost::json::object LocalizationJson(const DriveLocalizationReport& report,
                                     std::uint64_t bytes_received);
void PrintLocalization(const DriveLocalizationReport& report,
                       std::uint64_t bytes_received,
                       std::ostream& out);

// Scans that could not be read, in the words of the first of them.
Status CheckReadable(const DriveLocalizationReport& report);
// Where all scans are lost, or none of a tracked drive is good: what that may mean, what to do.
void NoteLost(const DriveLocalizationReport& report, bool is_tracked, std::ostream& err);

}  // namespace atlas
