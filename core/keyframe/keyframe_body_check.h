// Whether the compressed part of a keyframe blob is valid, without a keyframe made of it: who
// stores it must know, and has no use for its cells.
#pragma once

#include "core/base/bytes.h"
#include "core/geometry/grid_geometry.h"

namespace atlas {

// True for exactly those bodies that DecodeKeyframeBody takes, for a valid `grid` of which
// `blocks` have anchors. Looks at 16 cells at a time.
bool IsKeyframeBody(ByteSpan body, const GridGeometry& grid, std::size_t blocks);

}  // namespace atlas
