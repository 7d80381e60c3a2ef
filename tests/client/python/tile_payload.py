"""Canonical payloads of tile blobs, from docs/formats/tile.md alone."""

import ctypes
import struct

from roadatlas.tile_blob import parse_tile_blob

_ZSTD = ctypes.CDLL("libzstd.so.1")
_ZSTD.ZSTD_decompress.restype = ctypes.c_size_t
_ZSTD.ZSTD_decompress.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t]


def decompress(frame, size_bytes):
    content = ctypes.create_string_buffer(size_bytes)
    written = _ZSTD.ZSTD_decompress(content, size_bytes, frame, len(frame))
    assert written == size_bytes, f"{written} bytes of {size_bytes}"
    return content.raw


def canonical_payload(blob):
    tile = parse_tile_blob(blob)
    profile_hash = struct.unpack_from("<Q", blob, 13)[0]
    payload = struct.pack("<QQ", tile.key, profile_hash)
    for section in tile.sections:
        content = decompress(section.data, section.uncompressed_bytes)
        payload += struct.pack("<HI", section.id, len(content)) + content
    return payload
