// A bar of a round length with its name, drawn into a picture's bottom left corner.
#pragma once

#include <cstdint>

#include "client/render/image.h"

namespace atlas {

// Rows that the bar and its label take.
inline constexpr std::int64_t kScaleBarHeight_px = 18;

// 1, 2 or 5 times a power of ten metres: the longest that takes at most `max_px`; 0 if even a
// millimetre is longer.
double RoundBarLength(double metres_per_pixel, double max_px);

// Within the picture's last rows, `margin_px` from its edges. Pictures too small for it stay as
// they are.
void DrawScaleBar(double metres_per_pixel, std::int64_t margin_px, Image& image);

}  // namespace atlas
