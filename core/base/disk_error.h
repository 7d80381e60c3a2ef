// What the system says of a path, as the Status that callers act on.
#pragma once

#include <filesystem>
#include <string_view>

#include "core/base/status.h"

namespace atlas {

// "WHAT PATH: REASON" for an errno. Forbidden: kPermissionDenied. Full, or no descriptor or memory
// left: kResourceExhausted. Not there: kNotFound. Something else under the name: kConflict.
// Everything else: kUnavailable.
Status DiskError(std::string_view what, const std::filesystem::path& path, int error);

}  // namespace atlas
