// What the command line's process returns: scripts depend on these numbers.
#pragma once

#include "core/base/status.h"

namespace atlas {

enum class ExitCode : int {
  kSuccess = 0,
  kFailure = 1,
  kUsage = 2,
  kNotFound = 3,
  kConflict = 4,
  kUnavailable = 5,  // or timeout
  kInvalidData = 6,
};

ExitCode ExitCodeFor(StatusCode code);

}  // namespace atlas
