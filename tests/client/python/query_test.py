#!/usr/bin/python3
"""Region queries, and what tiles and digests are made of, against a real daemon."""

import hashlib
import struct
import unittest

import atlas_pb2
import xxhash
from roadatlas import Code, geometry
from support import AtlasCase
from tile_payload import canonical_payload

RADIUS_M = 60


class QueryTest(AtlasCase):

    def setUp(self):
        super().setUp()
        self.drive()

    def query(self, **fields):
        before = self.client.bytes_received
        reply = self.client.query_region(atlas_pb2.QueryRegion(**fields))
        self.assertEqual(self.client.bytes_received - before, reply.end.bytes)
        self.assertEqual(len(reply.tiles), reply.end.tiles)
        return reply

    def test_tiles_are_what_the_format_says(self):
        tiles = self.map_now()
        for key, tile in tiles.items():
            self.assertEqual(xxhash.xxh64_intdigest(canonical_payload(tile.blob)), tile.payload_hash,
                             geometry.tile_place(key))
        sha256 = hashlib.sha256()
        for key in sorted(tiles):
            payload = canonical_payload(tiles[key].blob)
            sha256.update(struct.pack(">QQ", key, len(payload)) + payload)
        digest = self.client.digest(60_000)
        self.assertEqual((digest.sha256, digest.tiles), (sha256.digest(), len(tiles)))

    def test_budget_is_kept_and_every_prefix_is_a_map(self):
        disc = atlas_pb2.QueryRegion.Disc(x_um=28_000_000, radius_um=RADIUS_M * 1_000_000)
        whole = self.query(disc=disc)
        self.assertFalse(whole.end.truncated)
        self.assert_usable(whole.tiles, self.profile.levels - 1)
        for budget in (64, 300, 1000, 4000, 10_000, whole.end.bytes - 1, whole.end.bytes):
            reply = self.query(disc=disc, budget_bytes=budget)
            self.assertLessEqual(reply.end.bytes, budget)
            self.assertEqual(reply.tiles, whole.tiles[:len(reply.tiles)])
            self.assertEqual(reply.end.truncated, len(reply.tiles) < len(whole.tiles))
        self.refused(Code.INVALID_ARGUMENT, self.query, budget_bytes=63, says="budget")

    def test_levels(self):
        by_level = [geometry.tile_place(tile.key)[0] for tile in self.query(finest_level=2, coarsest_level=4).tiles]
        self.assertEqual(by_level, sorted(by_level, reverse=True))
        self.assertEqual(set(by_level), {2, 3, 4})
        only = self.query(finest_level=2, only_finest=True).tiles
        self.assertEqual({geometry.tile_place(tile.key)[0] for tile in only}, {2})

    def test_the_past(self):
        self.assertEqual(self.query(at_revision=0, timeout_ms=60_000).tiles, [])
        self.refused(Code.INVALID_ARGUMENT, self.query, at_revision=1 << 40, timeout_ms=60_000)


if __name__ == "__main__":
    unittest.main()
