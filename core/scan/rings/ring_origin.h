// The azimuths at which the rings of a scan may begin.
#pragma once

#include <vector>

#include "core/scan/rings/return_directions.h"

namespace atlas {

// Less of the slope's change (0.25 degrees) than from any ring to the next one.
inline constexpr float kMinLeapSlope = 0.0044F;

// Three, the likeliest first: everywhere else rings pass smoothly, there the slope leaps. It does
// so at an edge of something near, too.
std::vector<float> SearchOrigins(const ReturnDirections& directions);

}  // namespace atlas
