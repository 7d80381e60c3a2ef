#!/usr/bin/python3
"""The golden files of tests/golden, read and written again from docs/formats alone."""

import dataclasses
import struct
import unittest

import xxhash
from keyframes import Cell, Keyframe, encode_body, with_checksum
from roadatlas.errors import BadTileBlob, BrokenReply, UselessDelta
from roadatlas.profile import parse_profile
from roadatlas.tile_blob import encode_tile_blob, merge_tile_blobs, parse_tile_blob
from roadatlas.tile_delta import apply_delta
from support import ROOT
from tile_payload import canonical_payload, decompress

PROFILE, KEYFRAME, TILE, DELTA = ((ROOT / "tests/golden" / name).read_bytes() for name in
                                  ("profile_v3.bin", "keyframe_v1.bin", "tile_v2.bin", "tile_delta_v2.bin"))
KEYFRAME_HEADER = struct.Struct("<4sBQIH4iiII")


class Planes:
    """A keyframe's body, taken plane by plane."""

    def __init__(self, body):
        self._body = body

    def take(self, size):
        plane, self._body = self._body[:size], self._body[size:]
        return plane

    def nibbles(self, count):
        packed = self.take((count + 1) // 2)
        return [packed[i // 2] >> 4 * (i % 2) & 0xF for i in range(count)]

    def bits(self, count):
        packed = self.take((count + 7) // 8)
        return [packed[i // 8] >> i % 8 & 1 for i in range(count)]

    def differences(self, count):
        low, high = self.take(count), self.take(count)
        values = [a | b << 8 for a, b in zip(low, high)]
        return [value >> 1 ^ -(value & 1) for value in values]

    def is_at_end(self):
        return not self._body


def wrapped(value):
    return (value + 0x8000) % 0x10000 - 0x8000


def decode_body(body, radius):
    side = 2 * radius
    planes = Planes(body)
    states = planes.nibbles(side * side)
    seen = [i for i, state in enumerate(states) if state & 3]
    altitudes = {}
    first_of_row = 0
    for i, difference in zip(seen, planes.differences(len(seen))):
        before = [k for k in altitudes if k // side == i // side]
        altitudes[i] = wrapped((altitudes[before[-1]] if before else first_of_row) + difference)
        first_of_row = altitudes[i] if not before else first_of_row
    anchors = []
    for difference in planes.differences((-(-side // 8))**2):
        anchors.append(wrapped((anchors[-1] if anchors else 0) + difference))
    with_column = [i for i, bit in zip(seen, planes.bits(len(seen))) if bit]
    nibbles = [planes.nibbles(len(with_column)) for _ in range(planes.take(1)[0])]
    columns = dict(zip(with_column, zip(*nibbles)))
    assert planes.is_at_end()
    cells = [Cell(altitudes[i], state >> 2, state & 3, columns.get(i, ())) if i in altitudes else None
             for i, state in enumerate(states)]
    return Keyframe(radius, [cells[i:i + side] for i in range(0, side * side, side)], anchors)


class GoldenFileTest(unittest.TestCase):

    def test_profile(self):
        profile = parse_profile(PROFILE)
        self.assertEqual(profile.hash, xxhash.xxh64_intdigest(PROFILE))
        self.assertEqual(profile.tile_side_m(1), 2 * profile.tile_side_m(0))

    def test_profiles_of_earlier_versions(self):
        expected = dataclasses.replace(parse_profile(PROFILE), hash=0)
        for name in ("profile_v1_first.bin", "profile_v1.bin", "profile_v2_first.bin", "profile_v2.bin"):
            encoded = (ROOT / "tests/golden" / name).read_bytes()
            profile = parse_profile(encoded)
            self.assertEqual(profile.hash, xxhash.xxh64_intdigest(encoded))
            self.assertEqual(dataclasses.replace(profile, hash=0), expected)
        for version in (0, 4):
            with self.assertRaises(BrokenReply):
                parse_profile(bytes([version]) + PROFILE[1:])

    def test_keyframe(self):
        header = KEYFRAME_HEADER.unpack_from(KEYFRAME)
        radius, body_bytes, compressed_bytes = header[4], header[10], header[11]
        self.assertEqual(with_checksum(KEYFRAME[:-8]), KEYFRAME)
        self.assertEqual(len(KEYFRAME), KEYFRAME_HEADER.size + compressed_bytes + 8)
        body = decompress(KEYFRAME[KEYFRAME_HEADER.size:-8], body_bytes)
        keyframe = decode_body(body, radius)
        self.assertTrue(any(cell and cell.column for row in keyframe.rows for cell in row))
        self.assertEqual(encode_body(keyframe), body)

    def test_tile(self):
        tile = parse_tile_blob(TILE)
        self.assertEqual([section.id for section in tile.sections], [1, 2, 3, 4])
        self.assertEqual(encode_tile_blob(tile), TILE)
        self.assertEqual(len(canonical_payload(TILE)), 16 + sum(6 + s.uncompressed_bytes for s in tile.sections))

    def test_sections_of_two_tiles_do_not_make_one(self):
        tile = parse_tile_blob(TILE)
        other = dataclasses.replace(tile, place=tile.place[:1] + struct.pack("<Q", tile.key + 1) + tile.place[9:])
        self.assertEqual(merge_tile_blobs(TILE, TILE), TILE)
        with self.assertRaises(BadTileBlob):
            merge_tile_blobs(TILE, encode_tile_blob(other))

    def test_delta(self):
        """It is to the golden tile; a few layers were seen once more, and nothing else changed."""
        blob = apply_delta(TILE, DELTA, None)
        before, after = sections_of(TILE), sections_of(blob)
        self.assertEqual({section_id for section_id in before if before[section_id] != after.get(section_id)}, {2})
        self.assertEqual(before.keys(), after.keys())
        payload_hash = xxhash.xxh64_intdigest(canonical_payload(blob))
        self.assertEqual(apply_delta(TILE, DELTA, payload_hash), blob)
        with self.assertRaises(UselessDelta):
            apply_delta(TILE, DELTA, payload_hash ^ 1)
        tile = parse_tile_blob(TILE)
        elsewhere = tile.place[:1] + struct.pack("<Q", tile.key + 1) + tile.place[9:]
        for other in (dataclasses.replace(tile, sections=tile.sections[:1] + tile.sections[2:]),
                      dataclasses.replace(tile, place=elsewhere)):
            with self.assertRaises(UselessDelta):
                apply_delta(encode_tile_blob(other), DELTA, None)

    def test_content_that_a_delta_does_not_promise(self):
        header_bytes, entry_bytes, hash_at = 24, 18, 10
        table_end = header_bytes + 4 * entry_bytes
        for section in range(4):
            head = bytearray(DELTA[:table_end])
            head[header_bytes + section * entry_bytes + hash_at] ^= 1
            head += struct.pack("<Q", xxhash.xxh64_intdigest(head))
            with self.assertRaisesRegex(UselessDelta, f"section {section + 1} has another content"):
                apply_delta(TILE, bytes(head) + DELTA[table_end + 8:], None)

    def test_no_damage_of_a_delta_makes_another_content(self):
        right = canonical_payload(apply_delta(TILE, DELTA, None))
        for bit in range(8 * len(DELTA)):
            damaged = bytearray(DELTA)
            damaged[bit // 8] ^= 1 << bit % 8
            try:
                self.assertEqual(canonical_payload(apply_delta(TILE, bytes(damaged), None)), right)
            except UselessDelta:
                pass
        for size in range(len(DELTA)):
            with self.assertRaises(UselessDelta):
                apply_delta(TILE, DELTA[:size], None)


def sections_of(blob):
    return {section.id: decompress(section.data, section.uncompressed_bytes)
            for section in parse_tile_blob(blob).sections}


if __name__ == "__main__":
    unittest.main()
