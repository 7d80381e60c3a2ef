"""The envelope of a tile blob (docs/formats/tile.md): its sections, still compressed, apart and together.

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
_HEADER = struct.Struct("<4sBQQBH")
_ENTRY = struct.Struct("<HIIQ")
_CHECKSUM = struct.Struct("<Q")


@dataclasses.dataclass(frozen=True)
class Section:
    """`entry` is the row of the section table, `data` the zstd frame."""

    id: int
    uncompressed_bytes: int
    entry: bytes
    data: bytes


@dataclasses.dataclass(frozen=True)
class TileBlob:
    """The header's fields before the number of sections, and the sections by rising id."""

    key: int
    head: bytes
    sections: tuple[Section, ...]


def parse_tile_blob(blob: bytes) -> TileBlob:
    """BadTileBlob unless sizes and checksums are right; what the zstd frames hold is not looked at."""
    if not _HEADER.size <= len(blob) <= MAX_BLOB_BYTES:
        raise BadTileBlob(f"{len(blob)} bytes are no tile blob")
    magic, version, key, _, _, count = _HEADER.unpack_from(blob)
    if magic != b"RAT1" or version != _VERSION or count > _MAX_SECTIONS:
        raise BadTileBlob(f"not the header of a tile: {blob[:_HEADER.size].hex(' ')}")
    table_end = _HEADER.size + count * _ENTRY.size
    if len(blob) < table_end + _CHECKSUM.size:
        raise BadTileBlob("the section table is cut")
    if _CHECKSUM.unpack_from(blob, table_end)[0] != xxhash.xxh64_intdigest(blob[:table_end]):
        raise BadTileBlob("the header's checksum is wrong")
    sections = []
    offset = table_end + _CHECKSUM.size
    for i in range(count):
        entry = blob[_HEADER.size + i * _ENTRY.size:][:_ENTRY.size]
        section_id, uncompressed, compressed, checksum = _ENTRY.unpack(entry)
        data = blob[offset:offset + compressed]
        offset += compressed
        if xxhash.xxh64_intdigest(data) != checksum or (sections and sections[-1].id >= section_id):
            raise BadTileBlob(f"section {section_id} is damaged")
        sections.append(Section(section_id, uncompressed, entry, data))
    if offset != len(blob):
        raise BadTileBlob(f"{len(blob)} bytes, the header says {offset}")
    return TileBlob(key, blob[:_HEADER.size - 2], tuple(sections))


def encode_tile_blob(tile: TileBlob) -> bytes:
    head = tile.head + struct.pack("<H", len(tile.sections)) + b"".join(s.entry for s in tile.sections)
    return head + _CHECKSUM.pack(xxhash.xxh64_intdigest(head)) + b"".join(s.data for s in tile.sections)


def merge_tile_blobs(held: bytes, added: bytes) -> bytes:
    """One blob with the sections of both, which must be of the same tile and payload hash."""
    first, second = parse_tile_blob(held), parse_tile_blob(added)
    if first.head != second.head:
        raise BadTileBlob("two blobs of different tiles")
    sections = {section.id: section for section in first.sections + second.sections}
    return encode_tile_blob(TileBlob(first.key, first.head, tuple(sections[i] for i in sorted(sections))))
