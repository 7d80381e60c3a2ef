#!/usr/bin/python3
"""Syncs by a client that holds nothing: areas, levels, budgets and cursors, compared with the map of a query."""

import unittest

import atlas_pb2
from roadatlas import Code, TileStore, geometry
from roadatlas.errors import BadTileBlob
from support import EVERYWHERE
from sync_case import SMALL_BUDGET, SyncCase


class AreaTest(SyncCase):

    def tiles_within(self, distance_m):
        """Keys of all tiles for whose bounds (min x, min y, max x, max y) the function gives at most 0."""
        def bounds(tile_key):
            level, x, y = geometry.tile_place(tile_key)
            side = self.profile.tile_side_m(level)
            return x * side, y * side, (x + 1) * side, (y + 1) * side
        return {k for k in self.map if distance_m(*bounds(k)) <= 0}

    def assert_comes(self, area, expected):
        reply = self.sync(area)
        self.assertEqual({tile.key for tile in reply.tiles}, expected)
        self.assert_usable(reply.tiles, self.coarsest)

    def test_all_of_it(self):
        reply = self.sync()
        self.assertEqual({tile.key: (tile.revision, tile.payload_hash, tile.blob) for tile in reply.tiles},
                         {tile.key: (tile.revision, tile.payload_hash, tile.blob) for tile in self.map.values()})
        self.assert_usable(reply.tiles, self.coarsest)
        self.assertEqual((reply.end.cursor, reply.end.revision, reply.not_modified, reply.removed),
                         (b"", self.client.status().revision, 0, []))

    def test_errors_are_the_sides_of_cells(self):
        for manifest in self.sync().manifests:
            for tile_key, error_mm in zip(manifest.keys, manifest.errors_mm, strict=True):
                level = geometry.tile_place(tile_key)[0]
                self.assertEqual(error_mm, (self.profile.cell_size_um << level) // 1000)

    def test_box(self):
        self.assert_comes(geometry.box((2, -3), (45, 20)), self.tiles_within(
            lambda x0, y0, x1, y1: max(x0 - 45, 2 - x1, y0 - 20, -3 - y1)))

    def test_disc(self):
        self.assert_comes(geometry.disc(30, 4, 12), self.tiles_within(
            lambda x0, y0, x1, y1: gap(30, 30, x0, x1)**2 + gap(4, 4, y0, y1)**2 - 144))

    def test_corridor(self):
        self.assert_comes(geometry.corridor([(10, 4), (40, 4), (310, 4)], 3), self.tiles_within(
            lambda x0, y0, x1, y1: gap(10, 310, x0, x1)**2 + gap(4, 4, y0, y1)**2 - 9))

    def test_tiles(self):
        keys = self.finest_block()[:2]
        reply = self.sync(geometry.tiles(keys + [geometry.tile_key(0, 999, 999)]))
        self.assertEqual(sorted(tile.key for tile in reply.tiles), keys)

    def test_keys_of_tiles_rise(self):
        low, high = self.finest_block()[:2]
        for keys in ([high, low], [low, low], [5, 3]):
            unsorted = atlas_pb2.Area(tiles=atlas_pb2.Area.Tiles(keys=keys))
            self.refused(Code.INVALID_ARGUMENT, self.sync, unsorted)
        reply = self.sync(geometry.tiles([high, low]))
        self.assertEqual(sorted(tile.key for tile in reply.tiles), [low, high])

    def test_levels(self):
        reply = self.sync(finest_level=2, coarsest_level=4)
        self.assertEqual({geometry.tile_place(tile.key)[0] for tile in reply.tiles}, {2, 3, 4})
        self.assert_usable(reply.tiles, 4)

    def test_what_makes_no_sense(self):
        for area in (atlas_pb2.Area(), geometry.corridor([], 1), geometry.box((1, 0), (0, 1))):
            self.refused(Code.INVALID_ARGUMENT, self.sync, area)
        self.refused(Code.INVALID_ARGUMENT, self.sync, finest_level=3, coarsest_level=2)
        self.refused(Code.INVALID_ARGUMENT, self.sync, sections=[64])
        self.refused(Code.INVALID_ARGUMENT, self.sync, cursor=b"none of yours")
        self.refused(Code.INVALID_ARGUMENT, self.sync, wait_revision=1 << 40)


class BudgetTest(SyncCase):

    def test_cursor_goes_on_without_gaps_or_repeats(self):
        whole = [tile.key for tile in self.sync().tiles]
        came = []
        cursor = b""
        while not came or cursor:
            reply = self.sync(budget_bytes=SMALL_BUDGET, cursor=cursor)
            self.assertLessEqual(reply.end.bytes, SMALL_BUDGET)
            self.assertTrue(reply.tiles)
            came += reply.tiles
            cursor = reply.end.cursor
        self.assertEqual([tile.key for tile in came], whole)
        self.assert_usable(came, self.coarsest)

    def test_cursor_is_of_its_area_and_levels(self):
        cursor = self.sync(budget_bytes=SMALL_BUDGET).end.cursor
        self.refused(Code.INVALID_ARGUMENT, self.sync, geometry.disc(0, 0, 5), cursor=cursor)
        self.refused(Code.INVALID_ARGUMENT, self.sync, coarsest_level=3, cursor=cursor)

    def test_no_room_for_the_next_tile_ends_it(self):
        reply = list(TileStore().synchronize(self.client, atlas_pb2.SyncRequest(area=EVERYWHERE, budget_bytes=800)))[-1]
        self.assertEqual(len(reply.tiles), 0)
        self.assertTrue(reply.end.cursor)
        self.refused(Code.INVALID_ARGUMENT, self.sync, budget_bytes=40, says="budget")

    def test_damaged_blob_changes_nothing(self):
        reply = self.sync()
        store = TileStore()
        blob = reply.tiles[-1].blob
        for damaged in (b"", blob[:-1], blob + b"\0", b"X" + blob[1:], blob[:-1] + bytes([blob[-1] ^ 1]),
                        reply.tiles[0].blob):
            reply.tiles[-1].blob = damaged
            with self.assertRaises(BadTileBlob):
                store.apply(atlas_pb2.SyncRequest(), reply)
            self.assertEqual(store.tiles, {})


def gap(low, high, other_low, other_high):
    """Between two intervals."""
    return max(other_low - high, low - other_high, 0)



if __name__ == "__main__":
    unittest.main()
