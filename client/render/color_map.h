// Colours for numbers: perceptually even maps, so that equal differences look equal.
#pragma once

#include "client/render/image.h"

namespace atlas {

// Dark blue over green to yellow (viridis), `t` in 0..1, clamped.
Rgb HeightColor(double t);
// Black over purple and orange to pale yellow (inferno), `t` in 0..1, clamped.
Rgb ColumnColor(double t);
// Distinct colours for small counts, 1 and up.
Rgb CountColor(int count);

Rgb Mix(const Rgb& a, const Rgb& b, double b_share);
// Brightness times `factor`, clamped.
Rgb Shade(const Rgb& color, double factor);

}  // namespace atlas
