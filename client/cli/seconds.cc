#include "client/cli/seconds.h"

#include <cmath>

#include "core/base/str_cat.h"

namespace atlas {

Result<std::chrono::milliseconds> TimeoutFromSeconds(double seconds) {
  if (!(seconds >= 0.0 && seconds <= 1e6)) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("timeout ", seconds, " s: expected 0 to 1000000"));
  }
  return std::chrono::milliseconds(std::llround(seconds * 1e3));
}

}  // namespace atlas
