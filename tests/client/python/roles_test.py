#!/usr/bin/python3
"""Who may ask for what, as docs/protocol.md has it. A refusal leaves the connection as it was."""

import functools
import signal
import unittest

import atlas_pb2
from fleet import FleetCase, keyframe_of
from roadatlas import AtlasClient, Code, RequestRefused, SessionUploader, geometry
from roadatlas.errors import ConnectionLost
from support import pose_at

RETRACT = atlas_pb2.ChangeSession.RETRACT
RELEASE = atlas_pb2.ChangeSession.RELEASE
PURGE = atlas_pb2.ChangeSession.PURGE
PUBLISH = atlas_pb2.ChangeSession.PUBLISH


class RolesTest(FleetCase):

    def setUp(self):
        super().setUp()
        self.car, self.merge, self.reader = (self.connect(self.tls(who)) for who in ("car.7", "aligner", "reader"))
        self.admin = self.connect(self.tls(), token=self.token())

    def refused(self, client, call, *args):
        with self.assertRaisesRegex(RequestRefused, client.name) as caught:
            call(*args)
        self.assertEqual((caught.exception.code, caught.exception.retry), (Code.PERMISSION_DENIED, False))
        self.assertEqual(client.status().keyframes, self.admin.status().keyframes)

    def test_uploads(self):
        for client, vehicle in ((self.car, "car.8"), (self.merge, "aligner"), (self.reader, "reader")):
            self.refused(client, client.upload_keyframe, keyframe_of(vehicle, client))
        self.assertEqual(self.admin.status().keyframes, 0)
        self.car.upload_keyframe(keyframe_of("car.7", self.car))
        self.admin.upload_keyframe(keyframe_of("car.8", self.admin))
        self.assertEqual(self.reader.status().keyframes, 2)

    def connecting(self, who):
        host, port = self.daemon.server.rsplit(":", 1)
        return functools.partial(AtlasClient, host, int(port), tls=self.tls(who))

    def test_an_uploader_refuses_nothing_where_the_client_may_not_upload(self):
        keyframes = [keyframe_of("car.7", self.car)]
        for who in ("aligner", "reader"):
            uploader = SessionUploader(self.connecting(who), "car.7", "s", first_pause_s=0.01)
            with self.assertRaises(RequestRefused) as caught:
                uploader.upload(keyframes)
            self.assertEqual(caught.exception.code, Code.PERMISSION_DENIED)
        # The keyframe of another name is refused itself.
        uploader = SessionUploader(self.connecting("car.7"), "car.8", "s")
        self.assertEqual(list(uploader.upload([keyframe_of("car.8", self.car)]).refused), [0])
        uploader = SessionUploader(self.connecting("car.7"), "car.7", "s")
        self.assertEqual(uploader.upload(keyframes).acknowledged, [0])

    def test_poses(self):
        for vehicle in ("car.7", "car.8"):
            self.admin.upload_keyframe(keyframe_of(vehicle, self.admin))
        other, own = ([atlas_pb2.PoseUpdate(key=keyframe_of(vehicle, self.car).key, pose=pose_at(2))]
                      for vehicle in ("car.8", "car.7"))
        self.refused(self.car, self.car.update_poses, other)
        self.refused(self.car, self.car.update_poses, own + other)
        self.refused(self.reader, self.reader.update_poses, own)
        self.assertEqual(self.car.update_poses(own).updated, 1)
        self.assertEqual(self.merge.update_poses(other).updated, 1)

    def test_sessions_and_verifications(self):
        self.car.upload_keyframe(keyframe_of("car.7", self.car))
        for client in (self.car, self.reader, self.merge):
            for action in (RETRACT, RELEASE, PURGE):
                self.refused(client, client.change_session, "car.7", "s", action)
        for client in (self.car, self.reader):
            self.refused(client, client.change_session, "car.7", "s", PUBLISH)
        self.assertFalse(self.merge.change_session("car.7", "s", PUBLISH).changed)
        self.admin.upload_keyframe(keyframe_of("car.8", self.admin))
        self.refused(self.reader, self.reader.keyframes, "car.7", "s")
        self.refused(self.car, self.car.keyframes, "car.8", "s")
        for client, vehicle in ((self.car, "car.7"), (self.merge, "car.8"), (self.admin, "car.7")):
            self.assertEqual([frame.sequence for frame in client.keyframes(vehicle, "s")], [0])
            self.assertEqual([frame.sequence for frame in client.read_keyframes(vehicle, "s").keyframes], [0])
        self.refused(self.reader, self.reader.read_keyframes, "car.7", "s")
        self.refused(self.car, self.car.read_keyframes, "car.8", "s")
        for client in (self.car, self.reader):
            self.refused(client, functools.partial(client.update_poses, [], publish=[("car.7", "s")]))
            self.refused(client, functools.partial(client.sessions, changed=True))
            self.refused(client, client.undo_poses, 1)
        self.assertEqual(self.merge.update_poses([], publish=[("car.7", "s")]).batch, 0)
        self.assertEqual(len(self.merge.sessions(changed=True)), 2)
        for client in (self.car, self.reader):
            self.refused(client, client.verify, 60_000)
            self.refused(client, client.log)
        self.refused(self.merge, lambda: self.merge.verify(60_000, repair=True))
        self.assertEqual(self.merge.verify(60_000).damaged, 0)
        self.assertEqual(self.merge.log(), [])
        self.assertTrue(self.admin.change_session("car.7", "s", RETRACT, author="somebody").changed)
        self.assertEqual([(event.kind, event.author) for event in self.admin.log()], [("retract", "alice")])

    def test_backups(self):
        for client in (self.car, self.merge, self.reader):
            self.refused(client, client.backup, "monday", 60_000)
            self.refused(client, client.backups)

    def test_everybody_reads_and_watches(self):
        for client in (self.car, self.merge, self.reader, self.admin):
            client.sync(atlas_pb2.SyncRequest(area=geometry.disc(0, 0, 50)))
            client.watch(geometry.disc(0, 0, 50)).cancel()

    def test_token_that_is_taken_back_ends_what_is_open(self):
        watch = self.admin.watch(geometry.disc(0, 0, 50))
        (self.folder / "tokens").rename(self.folder / "tokens.before")
        self.addCleanup(lambda: (self.folder / "tokens.before").rename(self.folder / "tokens"))
        (self.folder / "tokens").write_text("# nobody\n", encoding="ascii")
        self.daemon.process.send_signal(signal.SIGHUP)
        with self.assertRaises((ConnectionLost, RequestRefused)):
            self.assertIsNone(watch.next(30))
        with self.assertRaises((ConnectionLost, RequestRefused)):
            self.admin.status()
        self.assertEqual(self.car.status().keyframes, 0)


if __name__ == "__main__":
    unittest.main()
