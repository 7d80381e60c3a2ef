"""Keyframe blobs, encoded from docs/formats/keyframe.md alone: flat ground with a wall at one place."""

import dataclasses
import struct

import xxhash

MEASURED, DRIVEN = 1, 3
FREE, OBSTACLE = 1, 2
_SIDE_OF_BLOCK = 8
_MAX_RAW_BLOCK = 128 << 10


@dataclasses.dataclass(frozen=True)
class Cell:
    """A cell that was seen: altitude in mm above the sensor, and the nibbles of its column, lowest first."""

    altitude_mm: int
    occupancy: int = FREE
    source: int = MEASURED
    column: tuple[int, ...] = ()


@dataclasses.dataclass(frozen=True)
class Keyframe:
    """`rows` are the (2 r)^2 cells by y, then x; None where nothing was seen."""

    radius_cells: int
    rows: list[list[Cell | None]]
    anchors: list[int]
    sensor_height_mm: int = 1800


def road(radius_cells: int, bump_mm: int = 0) -> Keyframe:
    """Level ground 1.8 m below the sensor, a wall of two segments in the row x = r / 2, seen from its middle."""
    side = 2 * radius_cells
    wall = 3 * radius_cells // 2
    rows = [[Cell(-1800 + bump_mm, OBSTACLE, column=(14, 14)) if x == wall else Cell(-1800 + bump_mm)
             for x in range(side)] for _ in range(side)]
    blocks_along = -(-side // _SIDE_OF_BLOCK)
    return Keyframe(radius_cells, rows, [-2] * blocks_along**2)


def encode_keyframe(keyframe: Keyframe, profile_hash: int, cell_size_um: int) -> bytes:
    body = encode_body(keyframe)
    frame = zstd_frame(body)
    head = struct.pack("<4sBQIH4iiII", b"RAK1", 1, profile_hash, cell_size_um, keyframe.radius_cells,
                       2**30, 0, 0, 0, keyframe.sensor_height_mm, len(body), len(frame))
    return with_checksum(head + frame)


def with_checksum(content: bytes) -> bytes:
    return content + struct.pack("<Q", xxhash.xxh64_intdigest(content))


def encode_body(keyframe: Keyframe) -> bytes:
    cells = [cell for row in keyframe.rows for cell in row]
    seen = [cell for cell in cells if cell]
    columns = [cell.column for cell in seen if cell.column]
    height = max(map(len, columns), default=0)
    nibbles = [column[i] if i < len(column) else 0 for i in range(height) for column in columns]
    planes = [nibble_plane(nibbles[i * len(columns):(i + 1) * len(columns)]) for i in range(height)]
    return b"".join([
        nibble_plane([cell.source | cell.occupancy << 2 if cell else 0 for cell in cells]),
        planes_of_2(altitude_differences(keyframe.rows)),
        planes_of_2([now - before for before, now in zip([0] + keyframe.anchors, keyframe.anchors)]),
        bit_plane([bool(cell.column) for cell in seen]),
        bytes([height]),
        *planes])


def altitude_differences(rows: list[list[Cell | None]]) -> list[int]:
    differences = []
    first_of_row = 0
    for row in rows:
        altitudes = [cell.altitude_mm for cell in row if cell]
        differences += [now - before for before, now in zip([first_of_row] + altitudes, altitudes)]
        first_of_row = altitudes[0] if altitudes else first_of_row
    return differences


def planes_of_2(differences: list[int]) -> bytes:
    """Zigzag differences wrapped to 16 bits: all low bytes, then all high bytes."""
    wrapped = [(difference + 0x8000) % 0x10000 - 0x8000 for difference in differences]
    values = [value * 2 if value >= 0 else -2 * value - 1 for value in wrapped]
    return bytes(value & 0xFF for value in values) + bytes(value >> 8 for value in values)


def nibble_plane(nibbles: list[int]) -> bytes:
    padded = nibbles + [0] * (len(nibbles) % 2)
    return bytes(low | high << 4 for low, high in zip(padded[::2], padded[1::2]))


def bit_plane(bits: list[bool]) -> bytes:
    return sum(1 << i for i, bit in enumerate(bits) if bit).to_bytes((len(bits) + 7) // 8, "little")


def zstd_frame(content: bytes) -> bytes:
    """A zstd frame (RFC 8878) of raw blocks, with content size and checksum."""
    blocks = [content[i:i + _MAX_RAW_BLOCK] for i in range(0, len(content), _MAX_RAW_BLOCK)] or [b""]
    frame = struct.pack("<IBI", 0xFD2FB528, 0xA4, len(content))
    for i, block in enumerate(blocks):
        is_last = i + 1 == len(blocks)
        frame += struct.pack("<I", is_last | len(block) << 3)[:3] + block
    return frame + struct.pack("<I", xxhash.xxh64_intdigest(content) & 0xFFFFFFFF)
