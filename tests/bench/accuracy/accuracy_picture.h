// Where a map is wrong, from above, ten pixels a metre.
#pragma once

#include "client/render/image.h"
#include "tests/bench/accuracy/accuracy_score.h"

namespace atlas::testing {

// Grey: layers right (light) or not judged (dark). Red: no layer, orange: too few, blue: too many.
// Green: structure kept, magenta: structure lost. Cyan: a moving car's cell that is still occupied.
// At most 4000 pixels a side.
Image DrawErrors(const DriveMap& map, const TruthMap& truth, const TruthOptions& options);

}  // namespace atlas::testing
