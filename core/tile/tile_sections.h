// The sections of a tile: who contributed, the surface layers, the columns, when each was confirmed
// (docs/formats/tile.md).
#pragma once

#include "core/base/bytes.h"
#include "core/base/status.h"
#include "core/tile/tile.h"

namespace atlas {

Bytes EncodeContributors(const Tile& tile);
Bytes EncodeSurface(const Tile& tile, const MapProfile& profile);
Bytes EncodeColumns(const Tile& tile, const MapProfile& profile);
Bytes EncodeConfirmed(const Tile& tile, const MapProfile& profile);

// Each fills its part of `tile` or says what is wrong (kInvalidData). Columns and times come
// after the surface.
Status DecodeContributors(ByteSpan section, Tile& tile);
Status DecodeSurface(ByteSpan section, const MapProfile& profile, Tile& tile);
Status DecodeColumns(ByteSpan section, const MapProfile& profile, Tile& tile);
Status DecodeConfirmed(ByteSpan section, const MapProfile& profile, Tile& tile);

}  // namespace atlas
