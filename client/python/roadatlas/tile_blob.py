"""The envelope of a tile blob and of a delta (docs/formats/tile.md): sections, still compressed, apart and together.

A blob may hold only some of a tile's sections. Those of the same content, put together in the order of
their ids, are the tile's blob, byte for byte.
"""

import dataclasses
import struct

import xxhash

from roadatlas.errors import BadTileBlob

SURFACE = 2
COLUMNS = 3
CONFIRMED = 4
MAX_BLOB_BYTES = 32 << 20
_MAX_SECTIONS = 64
_VERSION = 2
_MAGIC = b"RAT1"
_DELTA_MAGIC = b"RAD1"
_HEADER = struct.Struct("<4sBQQBH")
_ENTRY = struct.Struct("<HIIQ")
_CHECKSUM = struct.Struct("<Q")


@dataclasses.dataclass(frozen=True)
class Section:
    """`data` is the zstd frame, `checksum` its hash; in a delta that of the content."""

    id: int
    uncompressed_bytes: int
    checksum: int
    data: bytes


@dataclasses.dataclass(frozen=True)
class TileBlob:
    """`place`: the header's fields between the magic and the number of sections. The sections are by rising id."""

    key: int
    profile_hash: int
    place: bytes
    sections: tuple[Section, ...]


def parse_tile_blob(blob: bytes) -> TileBlob:
    """BadTileBlob unless sizes and checksums are right; what the zstd frames hold is not looked at."""
    tile = _parse(blob, _MAGIC)
    for section in tile.sections:
        if xxhash.xxh64_intdigest(section.data) != section.checksum:
            raise BadTileBlob(f"section {section.id} is damaged")
    return tile


def parse_delta(blob: bytes) -> TileBlob:
    """The envelope of a delta, whose sections only their content can prove right. BadTileBlob."""
    return _parse(blob, _DELTA_MAGIC)


def encode_tile_blob(tile: TileBlob) -> bytes:
    table = b"".join(_ENTRY.pack(s.id, s.uncompressed_bytes, len(s.data), s.checksum) for s in tile.sections)
    head = _MAGIC + tile.place + struct.pack("<H", len(tile.sections)) + table
    return head + _CHECKSUM.pack(xxhash.xxh64_intdigest(head)) + b"".join(s.data for s in tile.sections)


def merge_tile_blobs(held: bytes, added: bytes) -> bytes:
    """One blob with the sections of both, which must be of the same tile and payload hash."""
    first, second = parse_tile_blob(held), parse_tile_blob(added)
    if first.place != second.place:
        raise BadTileBlob("two blobs of different tiles")
    sections = {section.id: section for section in first.sections + second.sections}
    return encode_tile_blob(dataclasses.replace(first, sections=tuple(sections[i] for i in sorted(sections))))


def _parse(blob: bytes, expected_magic: bytes) -> TileBlob:
    if not _HEADER.size <= len(blob) <= MAX_BLOB_BYTES:
        raise BadTileBlob(f"{len(blob)} bytes are no tile blob")
    magic, version, key, profile_hash, _, count = _HEADER.unpack_from(blob)
    if magic != expected_magic or version != _VERSION or count > _MAX_SECTIONS:
        raise BadTileBlob(f"not the header of a tile: {blob[:_HEADER.size].hex(' ')}")
    table_end = _HEADER.size + count * _ENTRY.size
    if len(blob) < table_end + _CHECKSUM.size:
        raise BadTileBlob("the section table is cut")
    if _CHECKSUM.unpack_from(blob, table_end)[0] != xxhash.xxh64_intdigest(blob[:table_end]):
        raise BadTileBlob("the header's checksum is wrong")
    sections: list[Section] = []
    offset = table_end + _CHECKSUM.size
    for i in range(count):
        section_id, uncompressed, compressed, checksum = _ENTRY.unpack_from(blob, _HEADER.size + i * _ENTRY.size)
        if sections and sections[-1].id >= section_id:
            raise BadTileBlob(f"section {section_id} follows section {sections[-1].id}")
        sections.append(Section(section_id, uncompressed, checksum, blob[offset:offset + compressed]))
        offset += compressed
    if offset != len(blob):
        raise BadTileBlob(f"{len(blob)} bytes, the header says {offset}")
    if sum(section.uncompressed_bytes for section in sections) > MAX_BLOB_BYTES:
        raise BadTileBlob("a payload above the limit")
    return TileBlob(key, profile_hash, blob[len(magic):_HEADER.size - 2], tuple(sections))
