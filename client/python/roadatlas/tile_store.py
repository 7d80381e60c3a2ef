"""The tiles that a client holds, as syncs brought them, and how it tells the daemon about them."""

import dataclasses
import struct
from collections import defaultdict
from collections.abc import Iterable, Iterator

import atlas_pb2
import xxhash

from roadatlas.client import AtlasClient
from roadatlas.errors import BadTileBlob, UselessDelta
from roadatlas.geometry import block_of, index_in_block
from roadatlas.sync_reply import SyncReply
from roadatlas.tile_blob import merge_tile_blobs, parse_tile_blob
from roadatlas.tile_delta import CAN_APPLY, apply_delta

ALL_SECTIONS: frozenset[int] = frozenset()
MAX_HELD = 65_536  # tiles that one request may tell one by one; as many blocks
_KEY_AND_HASH = struct.Struct("<QQ")


@dataclasses.dataclass(frozen=True)
class StoredTile:
    """`sections`: those that were asked for, whether the tile has them or not."""

    revision: int
    payload_hash: int
    sections: frozenset[int]
    blob: bytes


class TileStore:
    """Tiles by key. Nothing of it depends on a daemon: it holds across restarts and between daemons."""

    def __init__(self, takes_deltas: bool = CAN_APPLY) -> None:
        """`takes_deltas`: changed tiles may come as deltas to what is held, which needs python3-zstandard."""
        if takes_deltas and not CAN_APPLY:
            raise ValueError("deltas need the package python3-zstandard")
        self._takes_deltas = takes_deltas
        self.tiles: dict[int, StoredTile] = {}
        self._differing: set[int] = set()  # blocks whose tiles are told one by one

    def synchronize(self, client: AtlasClient, request: atlas_pb2.SyncRequest) -> Iterator[SyncReply]:
        """Asks until the store holds all that `request` wants, as the daemon has it; gives each reply once applied.

        The held tiles, cursor and `takes_deltas` of `request` are set here. A budget and a time bound each reply; stop when
        enough came. It ends too, with a cursor in the last reply, when these have no room for the next tile.
        """
        asked = atlas_pb2.SyncRequest()
        asked.CopyFrom(request)
        asked.cursor = b""
        asked.takes_deltas = self._takes_deltas
        while True:
            del asked.held[:]
            asked.held.extend(self.held())
            reply = client.sync(asked)
            useless = self.apply(asked, reply)
            yield reply
            if reply.differing_blocks or useless:
                asked.cursor = b""  # from the start: tiles of these blocks told one by one, the useless not at all
            elif reply.end.cursor and reply.tiles:
                asked.cursor = reply.end.cursor
            else:
                break
        if not reply.end.cursor:
            self._differing.clear()

    def apply(self, request: atlas_pb2.SyncRequest, reply: SyncReply) -> list[int]:
        """Takes what came and drops what is no more. BadTileBlob, and nothing changed, for a damaged blob.

        Keys of tiles that came as deltas to what is not held any more: these are dropped, too. Ask again.
        """
        wanted = frozenset(request.sections)
        came: dict[int, StoredTile] = {}
        useless: list[int] = []
        for tile in reply.tiles:
            try:
                came[tile.key] = self._patched(tile, wanted) if tile.base_hash else self._joined(tile, wanted)
            except UselessDelta:
                useless.append(tile.key)
        self.tiles.update(came)
        for key in [*reply.removed, *useless]:
            self.tiles.pop(key, None)
        self._differing.update(reply.differing_blocks)
        return useless

    def held(self) -> list[atlas_pb2.Held]:
        """What is held, by the sections of it: in blocks, and one by one where a block was said to differ or is held
        with several sets of sections. What is beyond the limits of a request is left out."""
        blocks: dict[int, list[int]] = defaultdict(list)
        for key in sorted(self.tiles):
            blocks[block_of(key)].append(key)
        groups: dict[frozenset[int], atlas_pb2.Held] = {}
        one_by_one: list[int] = []
        whole: list[int] = []
        for block, keys in blocks.items():
            is_mixed = len({self.tiles[key].sections for key in keys}) > 1
            (one_by_one if is_mixed or block in self._differing else whole).append(block)
        for key in [key for block in one_by_one for key in blocks[block]][:MAX_HELD]:
            group = self._group(groups, key)
            group.keys.append(key)
            group.payload_hashes.append(self.tiles[key].payload_hash)
        for block in whole[:MAX_HELD]:
            keys = blocks[block]
            group = self._group(groups, keys[0])
            group.blocks.append(block)
            group.masks.append(sum(1 << index_in_block(key) for key in keys))
            group.digests.append(block_digest((key, self.tiles[key].payload_hash) for key in keys))
        return list(groups.values())

    def _group(self, groups: dict[frozenset[int], atlas_pb2.Held], key: int) -> atlas_pb2.Held:
        sections = self.tiles[key].sections
        return groups.setdefault(sections, atlas_pb2.Held(sections=sorted(sections)))

    def _patched(self, tile: atlas_pb2.TileMessage, wanted: frozenset[int]) -> StoredTile:
        """The tile made of what is held of it, with the sections that are wanted and no others."""
        held = self.tiles.get(tile.key)
        if held is None or held.payload_hash != tile.base_hash:
            raise UselessDelta(f"tile {tile.key:#018x} came as a delta to what is not held")
        blob = apply_delta(held.blob, tile.blob, None if wanted else tile.payload_hash)
        return StoredTile(tile.revision, tile.payload_hash, wanted, blob)

    def _joined(self, tile: atlas_pb2.TileMessage, wanted: frozenset[int]) -> StoredTile:
        """The tile with what is held of the same content."""
        if parse_tile_blob(tile.blob).key != tile.key:
            raise BadTileBlob(f"another tile's blob came as {tile.key:#018x}")
        held = self.tiles.get(tile.key)
        if held is None or held.payload_hash != tile.payload_hash:
            return StoredTile(tile.revision, tile.payload_hash, wanted, tile.blob)
        sections = held.sections | wanted if held.sections and wanted else ALL_SECTIONS
        return StoredTile(tile.revision, tile.payload_hash, sections, merge_tile_blobs(held.blob, tile.blob))


def block_digest(keys_and_hashes: Iterable[tuple[int, int]]) -> int:
    """XXH64 over key and payload hash of the tiles held, by rising key."""
    return xxhash.xxh64_intdigest(b"".join(_KEY_AND_HASH.pack(*pair) for pair in keys_and_hashes))
