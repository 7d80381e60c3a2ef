#!/usr/bin/python3
"""Changed tiles as deltas to what is held, as docs/formats/tile.md has them, against a real daemon."""

import unittest

import atlas_pb2
from roadatlas import TileStore
from roadatlas.tile_blob import CONFIRMED, SURFACE
from roadatlas.tile_store import ALL_SECTIONS
from support import EVERYWHERE, RADIUS_CELLS, hashes
from sync_case import SMALL_BUDGET, SyncCase
from tile_payload import canonical_payload


class DeltaTest(SyncCase):

    def change(self, sequence=8, bump_mm=0):
        """One more keyframe, whose grid ends within the tiles."""
        self.client.upload_keyframe(self.upload(sequence, 8 * sequence, "near", RADIUS_CELLS // 3, bump_mm))
        self.fuse()

    def bring_up_to_date(self, store, **fields):
        """All that came, and the bytes of the replies."""
        replies = list(store.synchronize(self.client, atlas_pb2.SyncRequest(area=EVERYWHERE, **fields)))
        return [tile for reply in replies for tile in reply.tiles], sum(reply.end.bytes for reply in replies)

    def store(self, takes_deltas, **fields):
        store = TileStore(takes_deltas)
        self.bring_up_to_date(store, **fields)
        return store

    def test_less_comes_and_it_is_the_same(self):
        with_deltas, without = self.store(True), self.store(False)
        self.change()
        as_deltas, small = self.bring_up_to_date(with_deltas)
        whole, large = self.bring_up_to_date(without)
        self.assertEqual([tile.key for tile in as_deltas], [tile.key for tile in whole])
        self.assertTrue(any(tile.base_hash for tile in as_deltas))
        self.assertFalse(any(tile.base_hash for tile in whole))
        self.assertLess(small, 0.7 * large)
        cold = self.store(False)
        self.assert_holds(with_deltas, cold.tiles)
        self.assertEqual({k: (tile.revision, tile.sections) for k, tile in with_deltas.tiles.items()},
                         {k: (tile.revision, tile.sections) for k, tile in cold.tiles.items()})
        reply = self.sync(held=with_deltas.held())
        self.assertEqual((reply.tiles, reply.not_modified), ([], len(cold.tiles)))

    def test_one_after_the_other(self):
        store = self.store(True)
        for sequence in range(8, 12):
            self.change(sequence, bump_mm=10 * sequence)
            came, _ = self.bring_up_to_date(store)
            self.assertTrue(any(tile.base_hash for tile in came))
            self.assert_holds(store, self.map_now())

    def test_sections(self):
        store = self.store(True, sections=[SURFACE])
        self.change()
        came, _ = self.bring_up_to_date(store, sections=[SURFACE, CONFIRMED])
        self.assertTrue(any(tile.base_hash for tile in came))
        for tile_key, tile in self.store(False, sections=[SURFACE, CONFIRMED]).tiles.items():
            self.assertEqual(canonical_payload(store.tiles[tile_key].blob), canonical_payload(tile.blob))
        self.bring_up_to_date(store)
        self.assert_holds(store, self.map_now())
        self.assertEqual({tile.sections for tile in store.tiles.values()}, {ALL_SECTIONS})

    def test_budget(self):
        store = self.store(True)
        self.change()
        replies = list(store.synchronize(self.client, atlas_pb2.SyncRequest(area=EVERYWHERE,
                                                                            budget_bytes=SMALL_BUDGET)))
        self.assertGreater(len(replies), 2)
        self.assertLessEqual(max(reply.end.bytes for reply in replies), SMALL_BUDGET)
        self.assert_holds(store, self.map_now())

    def test_useless_delta_drops_the_tile_and_it_comes_whole(self):
        for sequence, spoil in ((8, self.lose_base), (9, self.damage_base)):
            store = self.store(True)
            self.change(sequence)
            asked = atlas_pb2.SyncRequest(area=EVERYWHERE, takes_deltas=True, held=[self.all_one_by_one(store)])
            reply = self.client.sync(asked)
            deltas = [tile.key for tile in reply.tiles if tile.base_hash]
            self.assertTrue(deltas)
            spoil(store, deltas[0])
            self.assertEqual(store.apply(asked, reply), deltas[:1])
            self.assertNotIn(deltas[0], store.tiles)
            came, _ = self.bring_up_to_date(store)
            self.assertEqual([(tile.key, tile.base_hash) for tile in came], [(deltas[0], 0)])
            self.assert_holds(store, self.map_now())

    def test_base_lost_under_way_is_healed_in_the_same_call(self):
        store = self.store(True)
        self.change()
        for tile_key in self.map:
            self.damage_base(store, tile_key)
        self.bring_up_to_date(store)
        now = self.map_now()
        changed = {k for k, payload_hash in hashes(now).items() if hashes(self.map).get(k) != payload_hash}
        for tile_key in changed:
            self.assertEqual(store.tiles[tile_key].blob, now[tile_key].blob)

    def test_comes_to_who_asks_for_it(self):
        store = self.store(True)
        self.change()
        for takes_deltas in (True, False):
            reply = self.sync(takes_deltas=takes_deltas, held=[self.all_one_by_one(store)])
            self.assertEqual(any(tile.base_hash for tile in reply.tiles), takes_deltas)

    @staticmethod
    def all_one_by_one(store):
        keys = sorted(store.tiles)
        return atlas_pb2.Held(keys=keys, payload_hashes=[store.tiles[k].payload_hash for k in keys])

    @staticmethod
    def lose_base(store, tile_key):
        del store.tiles[tile_key]

    @staticmethod
    def damage_base(store, tile_key):
        held = store.tiles[tile_key]
        store.tiles[tile_key] = type(held)(held.revision, held.payload_hash, held.sections,
                                           held.blob[:-1] + bytes([held.blob[-1] ^ 1]))


if __name__ == "__main__":
    unittest.main()
