#!/usr/bin/python3
"""Syncs by a client that holds tiles, and what it is sent after the map changed."""

import unittest

import atlas_pb2
from roadatlas import Code, TileStore, geometry
from roadatlas.tile_blob import COLUMNS, CONFIRMED, SURFACE
from support import EVERYWHERE, hashes, key, pose_at
from sync_case import SMALL_BUDGET, SyncCase

CONTRIBUTORS = 1


class HeldTest(SyncCase):

    def test_all_held_is_not_modified_and_nothing_comes(self):
        store = self.filled()
        self.assert_holds(store, self.map)
        reply = self.sync(held=store.held())
        self.assertEqual((reply.tiles, reply.not_modified, reply.removed), ([], len(self.map), []))
        self.assertTrue(all(reply.current_blocks))

    def test_tiles_one_by_one(self):
        right, wrong = self.finest_block()[:2]
        gone, far = geometry.tile_key(0, 3, 7), geometry.tile_key(0, 99, 0)
        held = self.one_by_one([right, wrong])
        held.payload_hashes[1] ^= 1
        held.keys.extend([gone, far])
        held.payload_hashes.extend([5, 5])
        reply = self.sync(geometry.disc(25, 100, 150), held=[held])
        self.assertEqual(reply.current_tiles, [True, False, False, False])
        self.assertEqual((reply.not_modified, reply.removed), (1, [gone]))
        came = {tile.key for tile in reply.tiles}
        self.assertNotIn(right, came)
        self.assertIn(wrong, came)

    def test_block_with_another_digest(self):
        keys = self.finest_block()
        reply = self.sync(held=[self.as_block(keys, wrong=1)])
        self.assertEqual((reply.current_blocks, reply.differing_blocks, reply.not_modified),
                         ([False], [geometry.block_of(keys[0])], 0))
        self.assertEqual({tile.key for tile in reply.tiles}, set(self.map) - set(keys))
        told = self.sync(held=[self.one_by_one(keys)])
        self.assertEqual((told.current_tiles, told.not_modified), ([True] * len(keys), len(keys)))

    def test_block_is_looked_at_as_a_whole(self):
        keys = self.finest_block()
        inside = geometry.tiles(keys[:1])
        reply = self.sync(inside, held=[self.as_block(keys)])
        self.assertEqual((reply.current_blocks, reply.not_modified, reply.tiles), ([True], 1, []))
        reply = self.sync(inside, held=[self.as_block(keys, wrong=1)])
        self.assertEqual((reply.current_blocks, len(reply.differing_blocks), reply.tiles), ([False], 1, []))

    def test_told_twice(self):
        keys = self.finest_block()
        for held in ([self.one_by_one(keys[:1]), self.one_by_one(keys[:1])],
                     [self.as_block(keys[:1]), self.as_block(keys[1:])],
                     [self.as_block(keys[:1]), self.one_by_one(keys[1:])]):
            self.refused(Code.INVALID_ARGUMENT, self.sync, held=held)

    def test_sections_apart_and_together(self):
        store = TileStore()
        for sections in ([SURFACE], [COLUMNS], [CONTRIBUTORS, CONFIRMED]):
            reply, = store.synchronize(self.client, atlas_pb2.SyncRequest(area=EVERYWHERE, sections=sections))
            self.assertEqual(len(reply.tiles), len(self.map))
        self.assert_holds(store, self.map)
        reply, = store.synchronize(self.client, atlas_pb2.SyncRequest(area=EVERYWHERE, sections=[SURFACE, CONFIRMED]))
        self.assertEqual((reply.tiles, reply.not_modified), ([], len(self.map)))

    def test_block_with_mixed_sections_is_told_one_by_one(self):
        store = self.filled(sections=[SURFACE])
        keys = self.finest_block()
        request = atlas_pb2.SyncRequest(area=geometry.tiles(keys[:1]), sections=[COLUMNS])
        list(store.synchronize(self.client, request))
        self.assertEqual({len(group.keys) for group in store.held()}, {1, len(keys) - 1})
        reply = self.sync(sections=[SURFACE], held=store.held())
        self.assertEqual((reply.tiles, reply.not_modified), ([], len(self.map)))


class ChangeTest(SyncCase):

    def correct(self, z_m):
        self.client.update_poses([atlas_pb2.PoseUpdate(key=key(7), pose=pose_at(56, z_m))], "surveyor")
        self.fuse()

    def test_corrected_pose_brings_what_changed_and_no_more(self):
        store = self.filled()
        self.correct(1.9)
        now = self.map_now()
        changed = {k for k, payload_hash in hashes(now).items() if hashes(self.map).get(k) != payload_hash}
        self.assertTrue(0 < len(changed) < len(now))
        replies = list(store.synchronize(self.client, atlas_pb2.SyncRequest(area=EVERYWHERE)))
        came = [tile.key for reply in replies for tile in reply.tiles]
        self.assertEqual(sorted(came), sorted(changed))
        self.assert_holds(store, now)
        self.assertEqual(replies[-1].not_modified, len(now) - len(changed))

    def test_retracted_session_removes_its_tiles(self):
        store = self.filled()
        self.client.change_session("car", "far", atlas_pb2.ChangeSession.RETRACT)
        self.fuse()
        now = self.map_now()
        replies = list(store.synchronize(self.client, atlas_pb2.SyncRequest(area=EVERYWHERE)))
        self.assertEqual(sorted(k for reply in replies for k in reply.removed), sorted(set(self.map) - set(now)))
        self.assert_holds(store, now)

    def test_small_budgets_go_on_to_the_end(self):
        for change in (lambda: self.correct(2.0),
                       lambda: self.client.change_session("car", "far", atlas_pb2.ChangeSession.RETRACT)):
            store = self.filled()
            for tile_key in self.finest_block():
                del store.tiles[tile_key]
            change()
            self.fuse()
            request = atlas_pb2.SyncRequest(area=EVERYWHERE, budget_bytes=SMALL_BUDGET)
            for reply in store.synchronize(self.client, request):
                self.assertLessEqual(reply.end.bytes, SMALL_BUDGET)
            self.assert_holds(store, self.map_now())

    def test_cursor_does_not_go_back_for_differing_blocks(self):
        store = self.filled()
        for tile_key in self.finest_block():
            del store.tiles[tile_key]
        self.correct(1.9)
        request = atlas_pb2.SyncRequest(area=EVERYWHERE, budget_bytes=SMALL_BUDGET, held=store.held())
        reply = self.client.sync(request)
        self.assertTrue(reply.differing_blocks and reply.end.cursor)
        store.apply(request, reply)
        while cursor := reply.end.cursor:
            request.cursor = cursor
            del request.held[:]
            request.held.extend(store.held())
            reply = self.client.sync(request)
            store.apply(request, reply)
        now = self.map_now()
        self.assertNotEqual(hashes(store.tiles), hashes(now))
        list(store.synchronize(self.client, atlas_pb2.SyncRequest(area=EVERYWHERE)))
        self.assert_holds(store, now)

    def test_what_changes_between_replies_comes_once_to_who_tells_what_came(self):
        request = atlas_pb2.SyncRequest(area=EVERYWHERE, budget_bytes=SMALL_BUDGET)
        store = TileStore()
        came = []
        while not came or request.cursor:
            reply = self.client.sync(request)
            store.apply(request, reply)
            came += [(tile.key, tile.payload_hash) for tile in reply.tiles]
            request.cursor = reply.end.cursor
            del request.held[:]
            request.held.extend(store.held())
            if len(came) == len(reply.tiles):
                self.correct(2.1)
        self.assertEqual(len(came), len(set(came)))
        self.assert_holds(store, self.map_now())


if __name__ == "__main__":
    unittest.main()
