// A tile as a difference to an earlier content of it (docs/formats/tile.md, "Delta"): for whoever
// holds that one. Sections that the earlier one lacks are in it as a whole.
#pragma once

#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

// What makes the blob `target` out of the blob `base`. kInvalidArgument: blobs of different tiles
// or profiles. Other errors as DecodeContainer.
Result<Bytes> EncodeTileDelta(ByteSpan base, ByteSpan target);

// The target's sections as a blob. Its compressed bytes may be others than the target's, where
// another version of zstd makes them; its content is checked section by section. kInvalidArgument:
// of another tile or profile. kUnsupported: another version. kInvalidData: damage, or another base.
Result<Bytes> ApplyTileDelta(ByteSpan base, ByteSpan delta);

}  // namespace atlas
