// A scan of a drive whose file is damaged: it counts as lost, and the others are looked at all the
// same.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/status.h"

namespace atlas {

struct UnreadableScan {
  std::uint32_t scan = 0;
  Status why;
};
using UnreadableScans = std::vector<UnreadableScan>;

}  // namespace atlas
