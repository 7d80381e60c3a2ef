#!/usr/bin/python3
"""Uploads, corrections and sessions against a real daemon. Keyframes are encoded from the document alone."""

import pathlib
import tempfile
import unittest

import atlas_pb2
import keyframes
from roadatlas import AtlasClient, Code, geometry
from support import BIN_DIR, RADIUS_CELLS, SMALL, AtlasCase, Daemon, key, pose_at

RETRACT = atlas_pb2.ChangeSession.RETRACT
RESTORE = atlas_pb2.ChangeSession.RESTORE
RELEASE = atlas_pb2.ChangeSession.RELEASE
PURGE = atlas_pb2.ChangeSession.PURGE
PUBLISH = atlas_pb2.ChangeSession.PUBLISH


class UploadTest(AtlasCase):

    def test_first_duplicate_and_conflict(self):
        first = self.upload(0, 0)
        reply = self.client.upload_keyframe(first)
        self.assertFalse(reply.duplicate)
        self.assertEqual(reply.tiles_marked, 4)
        again = self.client.upload_keyframe(first)
        self.assertEqual((again.duplicate, again.tiles_marked), (True, 0))
        self.refused(Code.CONFLICT, self.client.upload_keyframe, self.upload(0, 0, bump_mm=5))
        later = self.upload(0, 0)
        later.time_ms += 1
        self.refused(Code.CONFLICT, self.client.upload_keyframe, later)
        self.assertEqual(self.client.status().keyframes, 1)

    def test_duplicate_leaves_a_corrected_pose(self):
        self.client.upload_keyframe(self.upload(0, 0))
        self.client.update_poses([atlas_pb2.PoseUpdate(key=key(0), pose=pose_at(3))])
        self.fuse()
        before = self.client.digest(60_000)
        self.assertTrue(self.client.upload_keyframe(self.upload(0, 0)).duplicate)
        self.assertEqual(self.client.digest(60_000), before)

    def test_many_on_their_way(self):
        replies = self.client.upload_keyframes(self.upload(i, i, radius_cells=8) for i in range(100))
        self.assertEqual(len({reply.revision for reply in replies}), 100)
        self.assertEqual(self.client.status().keyframes, 100)

    def test_grids_of_any_size(self):
        for radius in (1, 3, 5, 61, 200):
            self.client.upload_keyframe(self.upload(radius, 0, radius_cells=radius))
        self.assertEqual(self.client.status().keyframes, 5)

    def test_damaged_blobs(self):
        whole = self.upload(0, 0)
        blob = whole.blob
        cut = keyframes.with_checksum(blob[:-9])
        other_profile = keyframes.encode_keyframe(keyframes.road(8), self.profile.hash ^ 1, self.profile.cell_size_um)
        for broken in (b"", blob[:-1], blob[:-1] + bytes([blob[-1] ^ 1]), b"X" + blob[1:], cut, other_profile):
            whole.blob = broken
            self.refused(Code.INVALID_DATA, self.client.upload_keyframe, whole)
        self.assertEqual(self.client.status().keyframes, 0)

    def test_what_a_cell_may_not_be(self):
        unseen_with_occupancy = keyframes.Cell(0, source=0)
        column_of_nothing = keyframes.Cell(-1800, column=(0, 0))
        for cell in (unseen_with_occupancy, column_of_nothing):
            grid = keyframes.road(8)
            grid.rows[3][3] = cell
            upload = self.upload(0, 0)
            upload.blob = keyframes.encode_keyframe(grid, self.profile.hash, self.profile.cell_size_um)
            self.refused(Code.INVALID_DATA, self.client.upload_keyframe, upload)

    def test_cells_that_were_not_seen(self):
        grid = keyframes.road(RADIUS_CELLS)
        for row in grid.rows[10:30]:
            row[::2] = [None] * len(row[::2])
        grid.rows[0] = [None] * len(grid.rows[0])
        upload = self.upload(0, 0)
        upload.blob = keyframes.encode_keyframe(grid, self.profile.hash, self.profile.cell_size_um)
        self.client.upload_keyframe(upload)
        self.fuse()
        cells = self.client.status().cells
        self.assertGreater(cells, 0)
        self.client.upload_keyframe(self.upload(1, 0))
        self.fuse()
        self.assertGreater(self.client.status().cells, cells)

    def test_names_times_and_poses(self):
        for change, code in ((lambda u: setattr(u.key, "vehicle", "a b"), Code.INVALID_ARGUMENT),
                             (lambda u: setattr(u, "time_ms", -1), Code.INVALID_DATA),
                             (lambda u: setattr(u, "time_ms", 1 << 60), Code.INVALID_DATA),
                             (lambda u: u.ClearField("pose"), Code.INVALID_DATA)):
            upload = self.upload(0, 0)
            change(upload)
            self.refused(code, self.client.upload_keyframe, upload)
        tilted = self.upload(0, 0)
        tilted.pose.CopyFrom(geometry.pose((0, 0, 1.8), (1, 0.1, 0, 0)))
        self.refused(Code.INVALID_DATA, self.client.upload_keyframe, tilted, says="upload")


class CorrectionTest(AtlasCase):

    def setUp(self):
        super().setUp()
        self.client.upload_keyframes(self.upload(i, 8 * i, radius_cells=20) for i in range(3))

    def test_poses_change_all_or_nothing(self):
        updates = [atlas_pb2.PoseUpdate(key=key(i), pose=pose_at(8 * i, z_m)) for i, z_m in ((0, 1.9), (1, 1.8))]
        reply = self.client.update_poses(updates, "surveyor")
        self.assertEqual(reply.updated, 1)
        self.assertGreater(reply.tiles_marked, 0)
        self.assertGreater(reply.batch, 0)
        self.fuse()
        again = self.client.update_poses(updates, "surveyor")
        self.assertEqual((again.updated, again.batch, again.revision), (0, 0, self.client.status().revision))
        before = self.client.digest(60_000)
        moved = atlas_pb2.PoseUpdate(key=key(2), pose=pose_at(17))
        self.refused(Code.NOT_FOUND, self.client.update_poses,
                     [moved, atlas_pb2.PoseUpdate(key=key(99), pose=pose_at(0))], says="99")
        self.refused(Code.INVALID_DATA, self.client.update_poses, [moved, moved])
        self.refused(Code.INVALID_DATA, self.client.update_poses, [moved, atlas_pb2.PoseUpdate(key=key(1))])
        self.assertEqual(self.client.digest(60_000), before)

    def test_session_retracted_and_restored(self):
        self.fuse()
        before = self.client.digest(60_000)
        reply = self.client.change_session("car", "near", RETRACT, "surveyor", "a test")
        self.assertEqual((reply.changed, reply.state), (True, "retracted"))
        self.assertFalse(self.client.change_session("car", "near", RETRACT).changed)
        self.fuse()
        self.assertEqual(self.client.status().tiles, 0)
        session, = self.client.sessions()
        self.assertEqual((session.vehicle, session.session, session.state, session.keyframes, session.last_sequence),
                         ("car", "near", "retracted", 3, 2))
        self.assertTrue(self.client.change_session("car", "near", RESTORE).changed)
        self.fuse()
        after = self.client.digest(60_000)
        self.assertEqual((after.sha256, after.tiles), (before.sha256, before.tiles))
        self.assertEqual(self.client.digest(60_000, at_revision=0).tiles, 0)
        self.refused(Code.NOT_FOUND, self.client.change_session, "car", "nobody", RETRACT)

    def test_session_quarantined_released_and_purged(self):
        before = self.client.digest(60_000)
        self.client.upload_keyframe(self.upload(0, 0, "wild", radius_cells=20))
        self.client.upload_keyframe(self.upload(1, 5_000, "wild", radius_cells=20))
        _, wild = self.client.sessions()
        self.assertEqual((wild.session, wild.state, self.client.status().quarantined), ("wild", "quarantined", 1))
        self.assertRegex(wild.reason, "keyframe 0 to 1: 5000 m in ")
        self.assertEqual(self.client.digest(60_000).sha256, before.sha256)
        self.assertEqual(self.client.change_session("car", "wild", RELEASE).state, "released")
        self.assertNotEqual(self.client.digest(60_000).sha256, before.sha256)
        self.assertEqual(self.client.change_session("car", "wild", PURGE).keyframes, 2)
        self.assertEqual(self.client.digest(60_000).sha256, before.sha256)
        self.refused(Code.CONFLICT, self.client.upload_keyframe, self.upload(0, 0, "wild", radius_cells=20))
        self.refused(Code.NOT_FOUND, self.client.digest, 60_000, before.revision)


    def test_session_staged_corrected_and_published(self):
        before = self.client.digest(60_000)
        for i in range(2):
            upload = self.upload(i, 40 + 8 * i, "night", radius_cells=20)
            upload.staged = True
            self.assertEqual(self.client.upload_keyframe(upload).tiles_marked, 0)
            self.assertTrue(self.client.upload_keyframe(upload).duplicate)
        self.assertEqual([session.state for session in self.client.sessions()], ["live", "staged"])
        self.client.update_poses([atlas_pb2.PoseUpdate(key=key(1, "night"), pose=pose_at(47))])
        self.assertEqual([(frame.sequence, frame.time_ms, frame.pose) for frame in
                          self.client.keyframes("car", "night")],
                         [(i, upload.time_ms - 1000 * (1 - i), pose_at(x_m)) for i, x_m in enumerate((40, 47))])
        self.assertEqual(self.client.digest(60_000).sha256, before.sha256)
        self.refused(Code.CONFLICT, self.client.change_session, "car", "night", RELEASE)
        reply = self.client.change_session("car", "night", PUBLISH, "surveyor")
        self.assertEqual((reply.changed, reply.state), (True, "live"))
        self.assertFalse(self.client.change_session("car", "night", PUBLISH).changed)
        self.assertNotEqual(self.client.digest(60_000).sha256, before.sha256)
        self.assertEqual(self.client.log()[-1].kind, "session_published")
        self.refused(Code.NOT_FOUND, self.client.keyframes, "car", "nobody")


    def test_keyframes_read_back(self):
        uploads = [self.upload(i, 60 + i, "back", radius_cells=8 + i) for i in (0, 3, 4, 9)]
        uploads[1].prior.CopyFrom(atlas_pb2.PositionPrior(x_um=-7, y_um=1 << 40, z_um=5, radius_mm=2_500))
        self.client.upload_keyframes(uploads)
        self.client.update_poses([atlas_pb2.PoseUpdate(key=key(4, "back"), pose=pose_at(47))])
        self.fuse()  # a tile that changes moves the revision, too
        for budget in (0, max(len(upload.blob) for upload in uploads) + 500, 1 << 20):
            read, last = [], None
            while True:
                part = self.client.read_keyframes("car", "back", after_sequence=last, budget_bytes=budget)
                self.assertTrue(part.end.bytes <= budget or budget == 0)
                read += part.keyframes
                if not part.end.has_more:
                    break
                last = part.keyframes[-1].sequence
            self.assertEqual([(frame.sequence, frame.time_ms, frame.blob) for frame in read],
                             [(upload.key.sequence, upload.time_ms, upload.blob) for upload in uploads])
            self.assertEqual([frame.pose for frame in read], [uploads[0].pose, uploads[1].pose, pose_at(47),
                                                              uploads[3].pose])
            self.assertEqual([frame.HasField("prior") for frame in read], [False, True, False, False])
            self.assertEqual(read[1].prior, uploads[1].prior)
        self.assertEqual(part.end.revision, self.client.status().revision)
        self.assertEqual(part.damaged, {})
        self.refused(Code.NOT_FOUND, self.client.read_keyframes, "car", "nobody")
        self.refused(Code.INVALID_ARGUMENT, self.client.read_keyframes, "car", "back", budget_bytes=63)

    def test_a_batch_on_a_condition_that_publishes_and_is_undone(self):
        before = self.client.digest(60_000)
        for i in range(2):
            upload = self.upload(i, 40 + 8 * i, "night", radius_cells=20)
            upload.staged = True
            self.client.upload_keyframe(upload)
        computed_at = self.client.read_keyframes("car", "night").end.revision
        changed = {info.session: info.changed_revision for info in self.client.sessions(changed=True)}
        self.assertEqual(changed["night"], computed_at)
        self.assertLess(changed["near"], computed_at)
        self.client.upload_keyframe(self.upload(9, 0, "elsewhere", radius_cells=8))
        with_another = self.client.digest(60_000)
        move = [atlas_pb2.PoseUpdate(key=key(1, "night"), pose=pose_at(47))]
        done = self.client.update_poses(move, "merge", if_revision=computed_at, publish=[("car", "night")])
        self.assertEqual([(change.session, change.state) for change in done.sessions], [("night", "live")])
        self.assertNotEqual(self.client.digest(60_000).sha256, with_another.sha256)
        self.refused(Code.CONFLICT, self.client.update_poses, move, "merge", if_revision=computed_at,
                     says="car/night changed since")
        undone = self.client.undo_poses(done.batch, "surveyor")
        self.assertEqual([(change.session, change.state) for change in undone.sessions], [("night", "staged")])
        self.assertEqual(self.client.digest(60_000).sha256, with_another.sha256)
        self.assertNotEqual(with_another.sha256, before.sha256)
        self.assertEqual([event.kind for event in self.client.log()],
                         ["poses", "session_published", "poses_undone", "session_staged"])
        self.refused(Code.CONFLICT, self.client.undo_poses, done.batch)
        self.refused(Code.NOT_FOUND, self.client.undo_poses, 99)


class SessionsTest(AtlasCase):

    def test_sessions_of_several_pages(self):
        uploads = []
        for i in range(2_400):
            upload = self.upload(1, 0, f"s{i:05}", radius_cells=8)
            upload.key.vehicle = f"car{i % 3}"  # each may begin a thousand an hour
            uploads.append(upload)
        self.client.upload_keyframes(uploads)
        names = sorted((upload.key.vehicle, upload.key.session) for upload in uploads)
        self.assertEqual([(session.vehicle, session.session) for session in self.client.sessions()], names)

    def test_a_vehicle_that_begins_too_many_sessions(self):
        work = self.enterContext(tempfile.TemporaryDirectory())
        daemon = self.enterContext(Daemon(BIN_DIR, pathlib.Path(work) / "atlas", *SMALL,
                                          "--sessions-per-hour-per-vehicle", "2"))
        host, port = daemon.server.rsplit(":", 1)
        client = self.enterContext(AtlasClient(host, int(port)))
        for session in ("a", "b"):
            client.upload_keyframe(self.upload(0, 0, session))
        self.refused(Code.UNAVAILABLE, client.upload_keyframe, self.upload(0, 0, "c"), says="2 an hour")
        client.upload_keyframe(self.upload(1, 8, "b"))


if __name__ == "__main__":
    unittest.main()
