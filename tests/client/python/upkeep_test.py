#!/usr/bin/python3
"""The log and verifications against a real daemon: what happened, what is damaged, and what is left of it."""

import sqlite3
import unittest

import atlas_pb2
from roadatlas import AtlasClient, Code, DaemonTooOld
from roadatlas.errors import BrokenReply
from support import AtlasCase, Peer, frame_of, key, pose_at

RETRACT = atlas_pb2.ChangeSession.RETRACT
EVENTS_OF_A_REPLY = 1000
LONG_MS = 120_000


class LogTest(AtlasCase):

    def test_tells_what_happened_oldest_first(self):
        self.drive()
        self.assertEqual(self.client.log(), [])
        corrected = self.client.update_poses([atlas_pb2.PoseUpdate(key=key(3), pose=pose_at(24.1))], author="alice")
        retracted = self.client.change_session("car", "far", RETRACT, author="bob", reason="rain")
        events = self.client.log()
        self.assertEqual([(event.kind, event.author, event.revision) for event in events],
                         [("poses", "alice", corrected.revision), ("retract", "bob", retracted.revision)])
        self.assertIn("far", events[1].subject)
        self.assertEqual(self.client.log(events[0].id), events[1:])
        self.assertEqual(self.client.log(events[1].id), [])

    def test_takes_as_many_replies_as_there_are_events(self):
        self.client.upload_keyframe(self.upload(0, 0, radius_cells=8))
        asked = [self.client.submit(atlas_pb2.UpdatePoses(updates=[{"key": key(0), "pose": pose_at(0.001 * (i + 1))}]))
                 for i in range(EVENTS_OF_A_REPLY + 10)]
        revisions = [self.client.result(request_id).revision for request_id in asked]
        self.assertEqual([event.revision for event in self.client.log()], sorted(revisions))


class BrokenLogTest(unittest.TestCase):

    def test_events_go_forward(self):
        event = {"id": 7, "kind": "poses"}
        greeting = frame_of(1, hello_reply={})
        for pages in ([[event, event]], [[event], [event]]):
            replies = [frame_of(2 + i, log_reply={"events": page}) for i, page in enumerate(pages)]
            with self.assertRaises(BrokenReply), Peer(greeting, *replies) as peer:
                with AtlasClient(port=peer.port) as client:
                    client.log()


class VerifyTest(AtlasCase):

    def test_reads_all_of_it(self):
        self.drive()
        status = self.client.status()
        for rebuild in (False, True):
            found = self.client.verify(LONG_MS, rebuild=rebuild)
            self.assertEqual((found.checked, found.damaged, found.mismatched, list(found.findings)),
                             (status.keyframes + status.tiles, 0, 0, []))
        self.refused(Code.TIMEOUT, self.client.verify, 0)

    def test_repairs_what_is_damaged(self):
        self.drive()
        self.damage_a_keyframe()
        self.client.update_poses([atlas_pb2.PoseUpdate(key=key(4), pose=pose_at(32.1))])
        found = self.client.verify(LONG_MS)
        self.assertEqual(found.damaged, 1)
        self.assertIn("keyframe", found.findings[0])
        repaired = self.client.verify(LONG_MS, repair=True, author="alice")
        self.assertEqual((repaired.given_up, repaired.damaged, repaired.mismatched), (1, 0, 0))
        self.assertEqual(self.client.status().keyframes, 10)
        self.assertIn(("keyframe_given_up", "alice"), [(event.kind, event.author) for event in self.client.log()])

    def damage_a_keyframe(self):
        """Below the daemon."""
        self.daemon.stop()
        with sqlite3.connect(self.work / "atlas/atlas.db") as database:
            database.execute("UPDATE keyframes SET blob = zeroblob(length(blob)) WHERE sequence = 3 AND id < 9")
            self.assertEqual(database.execute("SELECT changes()").fetchone(), (1,))
        database.close()
        self.start_daemon()


class NotFusedTest(AtlasCase):

    def flags(self):
        return "--fusion", "false"

    def test_only_a_rebuild_waits_for_tiles_that_are_dirty(self):
        self.client.upload_keyframe(self.upload(0, 0, radius_cells=8))
        self.assertEqual(self.client.verify(LONG_MS).damaged, 0)
        self.refused(Code.TIMEOUT, self.client.verify, 200, rebuild=True)


class EarlierDaemonTest(unittest.TestCase):

    def test_is_not_asked_for_repairs_that_it_would_pass_over(self):
        with Peer(frame_of(1, hello_reply={"protocol_major": 1, "protocol_minor": 7})) as peer:
            with AtlasClient(port=peer.port) as client, self.assertRaisesRegex(DaemonTooOld, "1[.]8.*1[.]7"):
                client.verify(LONG_MS, repair=True)

    def test_is_not_asked_for_corrections_on_a_condition(self):
        with Peer(frame_of(1, hello_reply={"protocol_major": 1, "protocol_minor": 10})) as peer:
            with AtlasClient(port=peer.port) as client:
                for call in (lambda: client.update_poses([], if_revision=7),
                             lambda: client.update_poses([], publish=[("car", "s")]),
                             lambda: client.undo_poses(1), lambda: client.read_keyframes("car", "s"),
                             lambda: client.sessions(changed=True)):
                    with self.assertRaisesRegex(DaemonTooOld, "1[.]11.*1[.]10"):
                        call()


if __name__ == "__main__":
    unittest.main()
