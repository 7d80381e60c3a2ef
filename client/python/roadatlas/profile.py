"""The first fields of a map profile, which say how large cells and tiles are (docs/formats/profile.md)."""

import dataclasses
import struct

import xxhash

from roadatlas.errors import BrokenReply

_VERSIONS = (1, 2, 3)  # all begin alike
_HEAD = struct.Struct("<BIHBB")


@dataclasses.dataclass(frozen=True)
class MapProfile:
    """`hash` is what keyframe and tile blobs name."""

    hash: int
    cell_size_um: int
    tile_cells: int
    levels: int
    column_segments: int

    def tile_side_m(self, level: int) -> float:
        return (self.cell_size_um << level) * self.tile_cells / 1e6


def parse_profile(encoded: bytes) -> MapProfile:
    if len(encoded) < _HEAD.size or encoded[0] not in _VERSIONS:
        raise BrokenReply("not a profile of version 1, 2 or 3")
    return MapProfile(xxhash.xxh64_intdigest(encoded), *_HEAD.unpack_from(encoded)[1:])
