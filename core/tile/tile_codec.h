// The tile blob (docs/formats/tile.md): numbered sections, each compressed and checked by itself,
// so that a planner can leave the columns where they are. Encoded once, after fusion; stored, sent
// and cached unchanged.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/bytes.h"
#include "core/base/status.h"
#include "core/tile/tile.h"

namespace atlas {

// Frozen numbers.
enum class TileSection : std::uint16_t {
  kContributors = 1,
  kSurface = 2,
  kColumns = 3,
  kConfirmed = 4,
};

inline constexpr std::size_t kMaxTileBytes = 32u << 20;  // blob and payload alike

// Tiles handed to the encoders are as fusion and the pyramid make them: contributors sorted and
// unique, at most kMaxCellLayers layers a cell with altitudes not falling, columns of
// `column_segments` nibbles, rounded sigmas. Decoding refuses anything else.

// The canonical uncompressed payload: what promise 1 (purity) and `atlas digest` speak of.
Bytes EncodeTilePayload(const Tile& tile, const MapProfile& profile);

struct EncodedTile {
  Bytes blob;
  std::uint64_t payload_hash = 0;  // Hash64 of the canonical payload
};
EncodedTile EncodeTile(const Tile& tile, const MapProfile& profile);

// kInvalidData on damage or on a blob of another profile; kUnsupported on a newer version. Sections
// with unknown numbers are skipped; without columns or times those are 0.
Result<Tile> DecodeTile(ByteSpan blob, const MapProfile& profile);

// The canonical payload of a blob, checksums verified.
Result<Bytes> TilePayloadFromBlob(ByteSpan blob);

}  // namespace atlas
