// The compressed part of a keyframe blob: structure-of-arrays planes (docs/formats/keyframe.md).
#pragma once

#include <cstddef>

#include "core/base/bytes.h"
#include "core/base/status.h"
#include "core/keyframe/keyframe.h"

namespace atlas {

// The largest body a grid can have: the cap before anything is allocated.
std::size_t MaxKeyframeBodyBytes(const GridGeometry& grid);

Bytes EncodeKeyframeBody(const Keyframe& keyframe);

// Fills cells, columns and anchors of `keyframe`, whose grid is set and valid. kInvalidData unless
// `body` is the one encoding of some valid keyframe.
Status DecodeKeyframeBody(ByteSpan body, Keyframe& keyframe);

}  // namespace atlas
