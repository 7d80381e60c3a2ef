// Tile blobs in the clear: key, profile hash, preset, then of each section number, length, content.
#pragma once

#include "core/geometry/map_profile.h"
#include "tests/fuzz/support/packed_mutator.h"

namespace atlas::fuzz {

// Goes behind its compression and its checksums.
Bytes MutateTile(ByteSpan blob, std::size_t max_size, Random& random);
// The header's checksum, over a table of as many sections as it says.
void SealTileHeader(Bytes& blob);
// Of 16 x 16 cells.
MapProfile TileProfile();
std::vector<Bytes> TileSeeds();

}  // namespace atlas::fuzz
