#!/usr/bin/python3
"""Backups by a real daemon: copies, progress, refusals, and one that is given up."""

import time
import unittest

import atlas_pb2
from roadatlas import AtlasClient, Code, RequestRefused
from roadatlas.errors import BrokenReply, ConnectionLost
from support import AtlasCase, Peer, frame_of

COPYING, VERIFYING = atlas_pb2.BackupReply.COPYING, atlas_pb2.BackupReply.VERIFYING
LONG_MS = 120_000
SOON_S = 60


class BackupTest(AtlasCase):

    def flags(self):
        """Slowly, so that there is something to be told."""
        self.folder = self.work / "backups"
        self.folder.mkdir()
        return "--backup-folder", str(self.folder), "--backup-mib-per-s", "1"

    def setUp(self):
        super().setUp()
        self.drive()

    def files(self):
        return sorted(path.name for path in self.folder.iterdir())

    def test_is_a_copy(self):
        told = []
        done = self.client.backup("monday", LONG_MS, author="alice", on_progress=told.append)
        self.assertEqual((done.sha256, done.tiles), (self.client.digest(LONG_MS).sha256, len(self.map_now())))
        self.assertEqual((done.keyframes, done.revision), (11, self.client.status().revision))
        stages = [reply.stage for reply in told]
        self.assertEqual((set(stages), stages), ({COPYING, VERIFYING}, sorted(stages)))
        for reply in told:
            self.assertLessEqual(reply.done_bytes, reply.total_bytes)
        event, = self.client.log()
        self.assertEqual((event.kind, event.author, event.subject), ("backup", "alice", "monday"))

    def test_are_listed(self):
        self.assertEqual(self.client.backups(), [])
        for name in ("tuesday", "monday"):
            self.client.backup(name, LONG_MS)
        found = {backup.name: backup.bytes for backup in self.client.backups()}
        self.assertEqual(found, {name: (self.folder / name).stat().st_size for name in ("monday", "tuesday")})

    def test_refusals_leave_the_connection_as_it_was(self):
        self.client.backup("monday", LONG_MS)
        self.refused(Code.CONFLICT, self.client.backup, "monday", LONG_MS, says="monday")
        self.refused(Code.INVALID_ARGUMENT, self.client.backup, "../monday", LONG_MS)
        self.refused(Code.TIMEOUT, self.client.backup, "tuesday", 0)
        with self.assertRaisesRegex(ValueError, "name"):
            self.client.backup("", LONG_MS)
        self.assertEqual(self.files(), ["monday"])

    def test_given_up_it_ends_with_its_client(self):
        def lose_patience(_):
            raise KeyboardInterrupt

        watch = self.client.watch(atlas_pb2.Area(disc={"radius_um": 10}))
        with self.assertRaises(KeyboardInterrupt):
            self.client.backup("monday", LONG_MS, on_progress=lose_patience)
        for call in (self.client.status, lambda: watch.next(SOON_S)):
            with self.assertRaisesRegex(ConnectionLost, "connect again"):
                call()
        self.client = self.connect()
        self.back_up_as_soon_as_the_other_one_has_ended("tuesday")
        self.assertEqual(self.files(), ["tuesday"])

    def back_up_as_soon_as_the_other_one_has_ended(self, name):
        until = time.monotonic() + SOON_S
        while True:
            try:
                return self.client.backup(name, LONG_MS)
            except RequestRefused as error:
                if error.code != Code.UNAVAILABLE or time.monotonic() > until:
                    raise


class NoFolderTest(AtlasCase):

    def test_says_so(self):
        self.refused(Code.INVALID_ARGUMENT, self.client.backup, "monday", LONG_MS, says="backup.folder")
        self.refused(Code.INVALID_ARGUMENT, self.client.backups, says="backup.folder")


class BackupReplyTest(unittest.TestCase):

    def test_stages_to_come_are_progress(self):
        told = []
        self.assertEqual(self.reply_to([{"stage": 9}, {"stage": COPYING}, {"stage": 3, "tiles": 5}], told).tiles, 5)
        self.assertEqual(told, [9, COPYING])

    def test_a_list_in_place_of_a_backup_is_broken(self):
        with self.assertRaises(BrokenReply):
            self.reply_to([{"backups": [{"name": "monday"}]}], [])

    @staticmethod
    def reply_to(replies, told):
        frames = [frame_of(2, backup_reply=reply) for reply in replies]
        with Peer(frame_of(1, hello_reply={}), b"".join(frames)) as peer, AtlasClient(port=peer.port) as client:
            return client.backup("monday", LONG_MS, on_progress=lambda reply: told.append(reply.stage))


if __name__ == "__main__":
    unittest.main()
