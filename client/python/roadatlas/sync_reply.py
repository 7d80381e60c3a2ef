"""The reply to a sync: manifests, the tiles that they announce, and the end (docs/protocol.md, Sync)."""

import dataclasses
from collections.abc import Callable

import atlas_pb2

from roadatlas.errors import BrokenReply


@dataclasses.dataclass
class SyncReply:
    """What a sync told. `current_tiles` and `current_blocks`: one for each that was told as held, in order."""

    manifests: list[atlas_pb2.SyncManifest]
    tiles: list[atlas_pb2.TileMessage]
    current_tiles: list[bool]
    current_blocks: list[bool]
    end: atlas_pb2.SyncEnd

    @property
    def removed(self) -> list[int]:
        return list(self.manifests[0].removed)

    @property
    def differing_blocks(self) -> list[int]:
        return list(self.manifests[0].differing_blocks)

    @property
    def not_modified(self) -> int:
        return self.manifests[0].not_modified


def read_sync_reply(request: atlas_pb2.SyncRequest, receive: Callable[[], atlas_pb2.Envelope]) -> SyncReply:
    """`receive` gives the next frame of it. BrokenReply where announced and sent do not agree."""
    manifests: list[atlas_pb2.SyncManifest] = []
    tiles: list[atlas_pb2.TileMessage] = []
    announced = 0
    while True:
        envelope = receive()
        match envelope.WhichOneof("body"):
            case "sync_manifest" if len(tiles) == announced:
                manifests.append(envelope.sync_manifest)
                announced += len(envelope.sync_manifest.keys)
            case "tile" if len(tiles) < announced:
                _check_announced(envelope.tile, manifests[-1], len(tiles) - announced)
                if envelope.tile.base_hash and not request.takes_deltas:
                    raise BrokenReply(f"tile {envelope.tile.key:#018x} came as a delta, which was not asked for")
                tiles.append(envelope.tile)
            case "sync_end" if manifests and len(tiles) == announced:
                return _whole_reply(request, manifests, tiles, envelope.sync_end)
            case other:
                raise BrokenReply(f"{other} after {len(tiles)} of {announced} tiles that a sync announced")


def _check_announced(tile: atlas_pb2.TileMessage, manifest: atlas_pb2.SyncManifest, index: int) -> None:
    promised = (manifest.keys[index], manifest.revisions[index], manifest.payload_hashes[index],
                manifest.bytes[index])
    if promised != (tile.key, tile.revision, tile.payload_hash, len(tile.blob)):
        raise BrokenReply(f"tile {tile.key:#018x} is not what its manifest announced")


def _whole_reply(request: atlas_pb2.SyncRequest, manifests: list[atlas_pb2.SyncManifest],
                 tiles: list[atlas_pb2.TileMessage], end: atlas_pb2.SyncEnd) -> SyncReply:
    held_tiles = sum(len(held.keys) for held in request.held)
    held_blocks = sum(len(held.blocks) for held in request.held)
    return SyncReply(manifests, tiles, _bits(manifests[0].current_tiles, held_tiles),
                     _bits(manifests[0].current_blocks, held_blocks), end)


def _bits(data: bytes, count: int) -> list[bool]:
    """Lowest bit of the first byte first; what is not there is false."""
    value = int.from_bytes(data, "little")
    return [bool(value >> i & 1) for i in range(count)]
