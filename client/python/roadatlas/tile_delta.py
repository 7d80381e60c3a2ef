"""A tile's blob out of an earlier one and a delta (docs/formats/tile.md, Delta). Needs python3-zstandard."""

import dataclasses
import struct

import xxhash

from roadatlas.errors import BadTileBlob, UselessDelta
from roadatlas.tile_blob import Section, TileBlob, encode_tile_blob, parse_delta, parse_tile_blob

try:
    import zstandard
except ImportError:  # deltas are not asked for then
    zstandard = None

CAN_APPLY = zstandard is not None
_LEVEL = 3
_MAX_WINDOW_BYTES = 1 << 27
_SECTION_HEAD = struct.Struct("<HI")


def apply_delta(base_blob: bytes, delta_blob: bytes, payload_hash: int | None) -> bytes:
    """The blob that the delta makes. `payload_hash`: of its content, if it has all sections of the tile.

    UselessDelta: one of the two is damaged, or it is not of this base.
    """
    try:
        base = parse_tile_blob(base_blob)
        delta = parse_delta(delta_blob)
        if delta.place != base.place:
            raise BadTileBlob("a delta of another tile")
        held = {section.id: section for section in base.sections}
        contents = {section.id: _content(section, held.get(section.id)) for section in delta.sections}
    except BadTileBlob as error:
        raise UselessDelta(str(error)) from error
    if payload_hash is not None and _payload_hash(delta, contents) != payload_hash:
        raise UselessDelta("a delta that makes another content than it should")
    return encode_tile_blob(dataclasses.replace(delta, sections=tuple(_packed(*item) for item in contents.items())))


def _content(section: Section, held: Section | None) -> bytes:
    prefix = b"" if held is None else _unpacked(held.data, held.uncompressed_bytes)
    content = _unpacked(section.data, section.uncompressed_bytes, prefix)
    if xxhash.xxh64_intdigest(content) != section.checksum:
        raise BadTileBlob(f"section {section.id} has another content than it should")
    return content


def _unpacked(frame: bytes, size_bytes: int, prefix: bytes = b"") -> bytes:
    """Never more than the declared size."""
    dictionary = zstandard.ZstdCompressionDict(prefix, zstandard.DICT_TYPE_RAWCONTENT) if prefix else None
    try:
        if zstandard.frame_content_size(frame) != size_bytes:
            raise BadTileBlob(f"a frame that does not declare the expected {size_bytes} bytes")
        return zstandard.ZstdDecompressor(dictionary, _MAX_WINDOW_BYTES).decompress(frame)
    except zstandard.ZstdError as error:
        raise BadTileBlob(f"a damaged frame: {error}") from error


def _packed(section_id: int, content: bytes) -> Section:
    data = zstandard.ZstdCompressor(_LEVEL, write_checksum=True, write_content_size=True).compress(content)
    return Section(section_id, len(content), xxhash.xxh64_intdigest(data), data)


def _payload_hash(tile: TileBlob, contents: dict[int, bytes]) -> int:
    payload = xxhash.xxh64(struct.pack("<QQ", tile.key, tile.profile_hash))
    for section_id, content in contents.items():
        payload.update(_SECTION_HEAD.pack(section_id, len(content)) + content)
    return payload.intdigest()
