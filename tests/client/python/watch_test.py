#!/usr/bin/python3
"""Watches against a real daemon: what is told, where, what else goes on meanwhile, and how they end."""

import threading
import time
import unittest

import atlas_pb2
from roadatlas import AtlasClient, Code, RequestRefused, TileStore, geometry
from roadatlas.changes import MAX_TOLD, Changes, changes_of, merge_events
from roadatlas.connection import MAX_WAITING_EVENTS
from roadatlas.errors import BrokenReply, ConnectionLost
from roadatlas.framing import encode_frame
from support import EVERYWHERE, AtlasCase, Peer, hashes, key, pose_at

SOON_MS = 50
MAX_WATCHES = 16
NEAR_ROAD = geometry.disc(0, 0, 10)
FAR_AWAY = geometry.disc(5000, 0, 100)


class WatchTest(AtlasCase):

    def told(self, watch, client=None):
        """All that a watch tells until nothing is dirty and it is silent: for longer where it has not told the last
        change, which may lie outside of its area or be late on a busy machine."""
        (client or self.client).wait(120_000)
        goal = max(self.revisions().values(), default=0)
        changed, removed, revision = {}, set(), 0
        while (changes := watch.next(1.0) or (watch.next(3.0) if revision < goal else None)) is not None:
            self.assertFalse(changes.below or changes.anything)
            self.assertTrue(changes.tiles or changes.removed)
            self.assertGreaterEqual(changes.revision, revision)
            revision = changes.revision
            for tile_key, tile_revision in changes.tiles.items():
                self.assertLess(changed.get(tile_key, 0), tile_revision)
            changed |= changes.tiles
            removed = (removed | set(changes.removed)) - changes.tiles.keys()
        return {k: revision for k, revision in changed.items() if k not in removed}, removed

    def revisions(self):
        return {k: tile.revision for k, tile in self.map_now().items()}

    def test_tells_an_upload_and_no_more(self):
        watch = self.client.watch(EVERYWHERE, interval_ms=SOON_MS)
        self.assertEqual(watch.since, 0)
        self.assertIsNone(watch.next(0.2))
        self.client.upload_keyframe(self.upload(0, 0))
        self.assertEqual(self.told(watch), (self.revisions(), set()))

    def test_tells_a_correction_of_another_client(self):
        self.drive()
        before = self.revisions()
        with self.client.watch(EVERYWHERE, interval_ms=SOON_MS) as watch:
            self.assertEqual(watch.since, self.client.status().revision)
            other = self.connect()
            other.update_poses([atlas_pb2.PoseUpdate(key=key(7), pose=pose_at(56, 1.9))])
            changed = dict(self.revisions_after(other).items() - before.items())
            self.assertTrue(0 < len(changed) < len(before))
            self.assertEqual(self.told(watch), (changed, set()))

    def revisions_after(self, client):
        self.assertFalse(client.wait(120_000).timed_out)
        return self.revisions()

    def test_tells_what_is_no_more(self):
        self.drive()
        before = self.revisions()
        with self.client.watch(EVERYWHERE, interval_ms=SOON_MS) as watch:
            self.client.change_session("car", "far", atlas_pb2.ChangeSession.RETRACT)
            _, removed = self.told(watch)
            self.assertEqual(removed, before.keys() - self.revisions().keys())
            self.assertTrue(removed)

    def test_only_its_area_and_levels(self):
        near, far, coarse = (self.client.watch(area, interval_ms=SOON_MS, finest_level=finest)
                             for area, finest in ((NEAR_ROAD, 0), (FAR_AWAY, 0), (NEAR_ROAD, 2)))
        self.client.upload_keyframe(self.upload(0, 0))
        self.client.upload_keyframe(self.upload(0, 300, "elsewhere"))
        changed, _ = self.told(near)
        inside = {tile.key for tile in self.client.sync(atlas_pb2.SyncRequest(area=NEAR_ROAD)).tiles}
        self.assertEqual(changed.keys(), inside)
        self.assertLess(len(inside), len(self.revisions()))
        self.assertEqual(self.told(coarse)[0].keys(), {k for k in inside if geometry.tile_place(k)[0] >= 2})
        self.assertLessEqual({geometry.tile_place(k)[0] for k in self.told(far)[0]}, {self.profile.levels - 1})

    def test_watch_and_sync_miss_nothing(self):
        """Watch first, then sync; then sync whatever is told."""
        store = TileStore()
        request = atlas_pb2.SyncRequest(area=EVERYWHERE)
        with self.client.watch(EVERYWHERE, interval_ms=SOON_MS) as watch:
            list(store.synchronize(self.client, request))
            for i in range(4):
                self.client.upload_keyframe(self.upload(i, 8 * i))
            self.client.wait(120_000)
            while watch.next(1.0) is not None:
                list(store.synchronize(self.client, request))
        self.assertEqual(hashes(store.tiles), hashes(self.map_now()))

    def test_interval(self):
        began = time.monotonic()
        with self.client.watch(EVERYWHERE, interval_ms=1500) as watch:
            for i in range(3):
                self.client.upload_keyframe(self.upload(i, 8 * i))
                self.fuse()
            came = []
            while watch.next(3.0) is not None:
                came.append(time.monotonic())
            self.assertTrue(came)
            # On a busy machine one is seen late, which makes none come earlier.
            for count, seen in enumerate(came, start=1):
                self.assertGreater(seen - began, 1.5 * count - 0.1)

    def test_what_makes_no_sense(self):
        self.refused(Code.INVALID_ARGUMENT, self.client.watch, atlas_pb2.Area())
        self.refused(Code.INVALID_ARGUMENT, self.client.watch, EVERYWHERE, finest_level=3, coarsest_level=2)
        watches = [self.client.watch(EVERYWHERE) for _ in range(MAX_WATCHES)]
        self.refused(Code.INVALID_ARGUMENT, self.client.watch, EVERYWHERE)
        watches[0].cancel()
        self.assertEqual(self.client.status().keyframes, 0)


class EndTest(AtlasCase):

    def test_cancel_ends_it_and_not_the_connection(self):
        watch, other = (self.client.watch(EVERYWHERE, interval_ms=interval) for interval in (60_000, SOON_MS))
        began = time.monotonic()
        watch.cancel()
        watch.cancel()
        self.assertLess(time.monotonic() - began, 20)
        self.assertEqual((list(watch), watch.next(5)), ([], None))
        self.client.upload_keyframe(self.upload(0, 0))
        self.fuse()
        self.assertTrue(next(iter(other)).tiles)

    def test_a_place_is_free_again(self):
        for _ in range(3 * MAX_WATCHES):
            self.once_there_is_a_place().cancel()

    def once_there_is_a_place(self):
        """A cancelled watch ends within its interval."""
        for _ in range(200):
            try:
                return self.client.watch(EVERYWHERE, interval_ms=SOON_MS)
            except RequestRefused:
                time.sleep(0.05)
        return self.fail("no place in time")

    def test_cancel_from_within_the_iteration(self):
        watch = self.client.watch(EVERYWHERE, interval_ms=SOON_MS)
        self.client.upload_keyframe(self.upload(0, 0))
        for changes in watch:
            self.assertTrue(changes.tiles)
            watch.cancel()

    def test_daemon_that_stops_is_told(self):
        watch = self.client.watch(EVERYWHERE, interval_ms=SOON_MS)
        stopping = threading.Thread(target=self.daemon.stop)
        stopping.start()
        with self.assertRaises((RequestRefused, ConnectionLost)) as caught:
            list(watch)
        if isinstance(caught.exception, RequestRefused):
            self.assertEqual((caught.exception.code, caught.exception.retry), (Code.UNAVAILABLE, True))
        stopping.join()
        self.assertEqual(list(watch), [])


class SlowWatcherTest(AtlasCase):

    def test_events_that_nobody_fetched_tell_all(self):
        with self.client.watch(EVERYWHERE, interval_ms=SOON_MS) as watch:
            for i in range(2 * MAX_WAITING_EVENTS):
                self.client.upload_keyframe(self.upload(i, 0.5 * i, radius_cells=10))
                self.fuse()
            time.sleep(0.2)
            self.client.status()
            events = []
            while (changes := watch.next(0.5)) is not None:
                events.append(changes)
            self.assertLessEqual(len(events), MAX_WAITING_EVENTS + 1)
            told = {}
            for changes in events:
                told |= changes.tiles
            self.assertEqual(told, {k: tile.revision for k, tile in self.map_now().items()})


class LostDetailTest(unittest.TestCase):

    @staticmethod
    def event(revision, tiles, **fields):
        return atlas_pb2.WatchEvent(revision=revision, keys=tiles.keys(), revisions=tiles.values(), **fields)

    def test_two_events_become_one(self):
        event = self.event(5, {1: 4, 2: 5, 3: 5}, below=[9])
        merge_events(event, self.event(8, {2: 0, 3: 7, 4: 8}, below=[9, 10]))
        self.assertEqual(changes_of(event), Changes(8, {1: 4, 3: 7, 4: 8}, [2], [9, 10], False))

    def test_too_much_becomes_anything(self):
        event = self.event(5, {k: 5 for k in range(1, MAX_TOLD)})
        merge_events(event, self.event(6, {1: 6}, below=[9]))
        self.assertEqual(len(changes_of(event).tiles), MAX_TOLD - 1)
        merge_events(event, self.event(7, {9_999: 7}))
        self.assertEqual(changes_of(event), Changes(7, {}, [], [], True))
        merge_events(event, self.event(8, {1: 8}))
        self.assertEqual(changes_of(event), Changes(8, {}, [], [], True))

    def test_is_handed_on(self):
        told = {"keys": [3], "revisions": [0], "below": [7], "revision": 4}
        with (self.peer({"revision": 2}, told, {"anything": True, "revision": 9}) as peer,
              AtlasClient(port=peer.port) as client):
            watch = client.watch(EVERYWHERE)
            self.assertEqual((watch.since, watch.next(5), watch.next(5)),
                             (2, Changes(4, {}, [3], [7], False), Changes(9, {}, [], [], True)))
            with self.assertRaises(ConnectionLost):
                watch.next(5)

    def test_event_that_makes_no_sense(self):
        with self.peer({}, {"keys": [1, 2], "revisions": [3]}) as peer, AtlasClient(port=peer.port) as client:
            watch = client.watch(EVERYWHERE)
            with self.assertRaises(BrokenReply):
                watch.next(5)
        with self.peer() as peer, AtlasClient(port=peer.port) as client, self.assertRaises(ConnectionLost):
            client.watch(EVERYWHERE)

    @staticmethod
    def peer(*events):
        greeting = encode_frame(atlas_pb2.Envelope(request_id=1, hello_reply={}).SerializeToString())
        frames = [encode_frame(atlas_pb2.Envelope(request_id=2, watch_event=event).SerializeToString())
                  for event in events]
        return Peer(greeting, b"".join(frames))


if __name__ == "__main__":
    unittest.main()
