"""A daemon with a small drive, its map as a query tells it, and what the tests of syncs ask of both."""

import atlas_pb2
from roadatlas import TileStore, geometry
from roadatlas.tile_store import block_digest
from support import EVERYWHERE, AtlasCase
from tile_payload import canonical_payload

SMALL_BUDGET = 5000


class SyncCase(AtlasCase):

    def setUp(self):
        super().setUp()
        self.drive()
        self.map = self.map_now()
        self.coarsest = self.profile.levels - 1

    def sync(self, area=EVERYWHERE, **fields):
        before = self.client.bytes_received
        reply = self.client.sync(atlas_pb2.SyncRequest(area=area, **fields))
        self.assertEqual(self.client.bytes_received - before, reply.end.bytes)
        self.assertEqual(len(reply.tiles), reply.end.tiles)
        return reply

    def filled(self, **fields):
        """A store with all of the map."""
        store = TileStore()
        list(store.synchronize(self.client, atlas_pb2.SyncRequest(area=EVERYWHERE, **fields)))
        return store

    def one_by_one(self, keys, sections=()):
        return atlas_pb2.Held(sections=sections, keys=keys, payload_hashes=[self.map[k].payload_hash for k in keys])

    def as_block(self, keys, sections=(), wrong=0):
        return atlas_pb2.Held(sections=sections, blocks=[geometry.block_of(keys[0])],
                              masks=[sum(1 << geometry.index_in_block(k) for k in keys)],
                              digests=[block_digest((k, self.map[k].payload_hash) for k in keys) ^ wrong])

    def finest_block(self):
        """The keys of a block with several tiles of level 0."""
        blocks = {}
        for tile_key in sorted(self.map):
            if geometry.tile_place(tile_key)[0] == 0:
                blocks.setdefault(geometry.block_of(tile_key), []).append(tile_key)
        return max(blocks.values(), key=len)

    def assert_holds(self, store, tiles):
        """The same contents, whoever compressed them."""
        self.assertEqual({k: (tile.payload_hash, canonical_payload(tile.blob)) for k, tile in store.tiles.items()},
                         {k: (tile.payload_hash, canonical_payload(tile.blob)) for k, tile in tiles.items()})
