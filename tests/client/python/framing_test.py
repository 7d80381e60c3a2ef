#!/usr/bin/python3
"""Frames and digests as docs/protocol.md prints them, and the reader of frames on bytes cut anywhere."""

import re
import struct
import unittest

import atlas_pb2
from roadatlas import geometry
from roadatlas.errors import BadChecksum, BadMagic, FrameCut, FrameTooLong
from roadatlas.framing import MAX_PAYLOAD_BYTES, FrameReader, encode_frame
from roadatlas.tile_store import block_digest
from support import ROOT

DOCUMENT = (ROOT / "docs/protocol.md").read_text(encoding="utf-8")
HELLO = atlas_pb2.Envelope(request_id=1, hello=atlas_pb2.Hello(protocol_major=1, client_name="demo"))
BACKUP = atlas_pb2.Envelope(request_id=5, backup_request=atlas_pb2.BackupRequest(name="monday", timeout_ms=3_600_000))
SYNC = atlas_pb2.Envelope(request_id=2, sync_request=atlas_pb2.SyncRequest(
    area=geometry.disc(1.5, -2, 100), sections=[2], budget_bytes=65536,
    held=[atlas_pb2.Held(keys=[geometry.tile_key(0, 0, 0)], payload_hashes=[0x1122334455667788])]))
WATCH = atlas_pb2.Envelope(request_id=3, watch_request=atlas_pb2.WatchRequest(
    area=geometry.disc(1.5, -2, 100), interval_ms=1000))
HELLO_REPLY = atlas_pb2.Envelope(request_id=1, hello_reply=atlas_pb2.HelloReply(
    protocol_major=1, protocol_minor=11, profile=b"\1\2\3", atlas_id=bytes(range(16)), epoch=1, revision=41,
    max_frame_bytes=MAX_PAYLOAD_BYTES, name="car.7", role="vehicle", last_sequence=11))
UPLOAD = atlas_pb2.Envelope(request_id=4, upload_keyframe=atlas_pb2.UploadKeyframe(
    key=atlas_pb2.KeyframeKey(vehicle="car.7", session="monday", sequence=12), time_ms=1_790_000_000_000,
    pose=atlas_pb2.Pose(x_um=1_500_000, y_um=-2_000_000, z_um=1_800_000, qw=1 << 30), blob=b"\xaa\xbb\xcc"))
UPLOADED = atlas_pb2.Envelope(request_id=4, upload_reply=atlas_pb2.UploadReply(revision=42, tiles_marked=9))
BUSY = atlas_pb2.Envelope(request_id=4, error=atlas_pb2.Error(code=5, message="store: busy", retry=True,
                                                              retry_after_ms=250))
SESSIONS = atlas_pb2.Envelope(request_id=5, sessions_request=atlas_pb2.SessionsRequest(
    after_vehicle="car.7", after_session="monday", limit=1))
PAGE = atlas_pb2.Envelope(request_id=5, sessions_reply=atlas_pb2.SessionsReply(
    sessions=[atlas_pb2.SessionInfo(vehicle="car.7", session="tuesday", state="live", keyframes=2, bytes=300,
                                    first_time_ms=1_790_000_000_000, last_time_ms=1_790_000_001_000,
                                    last_sequence=1)], has_more=True))
KEYFRAMES = atlas_pb2.Envelope(request_id=6, keyframes_request=atlas_pb2.KeyframesRequest(
    vehicle="car.7", session="monday", after_sequence=11))
KEYFRAMES_REPLY = atlas_pb2.Envelope(request_id=6, keyframes_reply=atlas_pb2.KeyframesReply(keyframes=[
    atlas_pb2.KeyframeInfo(sequence=12, time_ms=1_790_000_000_000, pose=UPLOAD.upload_keyframe.pose)]))
STAGED = atlas_pb2.Envelope(request_id=7, upload_keyframe=atlas_pb2.UploadKeyframe(
    key=atlas_pb2.KeyframeKey(vehicle="car.7", session="tuesday"), time_ms=1_790_000_000_000,
    pose=UPLOAD.upload_keyframe.pose, blob=b"\xaa\xbb\xcc", staged=True))
PUBLICATION = atlas_pb2.Envelope(request_id=8, change_session=atlas_pb2.ChangeSession(
    vehicle="car.7", session="tuesday", action=atlas_pb2.ChangeSession.PUBLISH))
READ = atlas_pb2.Envelope(request_id=9, read_keyframes=atlas_pb2.ReadKeyframes(
    vehicle="car.7", session="monday", after_sequence=11, budget_bytes=65536))
KEYFRAME = atlas_pb2.Envelope(request_id=9, keyframe=atlas_pb2.KeyframeMessage(
    sequence=12, time_ms=1_790_000_000_000, pose=UPLOAD.upload_keyframe.pose,
    prior=atlas_pb2.PositionPrior(x_um=1_400_000, y_um=-2_100_000, z_um=1_900_000, radius_mm=2500), blob=b"\xaa\xbb\xcc"))
KEYFRAMES_END = atlas_pb2.Envelope(request_id=9, keyframes_end=atlas_pb2.KeyframesEnd(keyframes=1, bytes=96, revision=42))
CORRECTION = atlas_pb2.Envelope(request_id=10, update_poses=atlas_pb2.UpdatePoses(
    updates=[atlas_pb2.PoseUpdate(key=STAGED.upload_keyframe.key, pose=UPLOAD.upload_keyframe.pose)], if_revision=42,
    publish=[atlas_pb2.SessionName(vehicle="car.7", session="tuesday")]))
CORRECTED = atlas_pb2.Envelope(request_id=10, update_poses_reply=atlas_pb2.UpdatePosesReply(
    updated=1, tiles_marked=9, revision=43, batch=1,
    sessions=[atlas_pb2.UpdatePosesReply.SessionChange(vehicle="car.7", session="tuesday", state="live")]))
UNDOING = atlas_pb2.Envelope(request_id=11, undo_poses=atlas_pb2.UndoPoses(batch=1))
MANIFEST = atlas_pb2.Envelope(request_id=2, sync_manifest=atlas_pb2.SyncManifest(
    keys=[geometry.tile_key(1, 1, 1)], revisions=[42], payload_hashes=[0x0807060504030201], bytes=[3], errors_mm=[200],
    current_tiles=b"\1", not_modified=1))
TILE = atlas_pb2.Envelope(request_id=2, tile=atlas_pb2.TileMessage(
    key=geometry.tile_key(1, 1, 1), revision=42, payload_hash=0x0807060504030201, blob=b"\xaa\xbb\xcc"))
END = atlas_pb2.Envelope(request_id=2, sync_end=atlas_pb2.SyncEnd(tiles=1, bytes=116, revision=42))
ENVELOPES = [HELLO, BACKUP, SYNC, WATCH, HELLO_REPLY, UPLOAD, UPLOADED, BUSY, SESSIONS, PAGE, KEYFRAMES,
             KEYFRAMES_REPLY, STAGED, PUBLICATION, READ, KEYFRAME, KEYFRAMES_END, CORRECTION, CORRECTED, UNDOING, MANIFEST,
             TILE, END]


def leading_bytes(line):
    """The two-digit hexadecimal numbers that a line begins with."""
    match = re.match(r"\s*((?:[0-9a-f]{2}(?:\s+|$))*)", line)
    return bytes.fromhex(match[1])


def golden_frames():
    """The frames in the document's code blocks."""
    for block in re.findall(r"```\n(.*?)```", DOCUMENT, re.S):
        if block.startswith("52 41 46 31"):
            yield b"".join(map(leading_bytes, block.splitlines()))


class GoldenTest(unittest.TestCase):

    def test_frames_of_the_document_are_made(self):
        for envelope, frame in zip(ENVELOPES, golden_frames()):
            if envelope is not TILE:  # whose request_id comes last
                self.assertEqual(encode_frame(envelope.SerializeToString()), frame)

    def test_frames_of_the_document_are_read(self):
        payloads = list(FrameReader().feed(b"".join(golden_frames())))
        self.assertEqual([atlas_pb2.Envelope.FromString(payload) for payload in payloads], ENVELOPES)

    def test_the_end_counts_the_reply(self):
        reply = list(golden_frames())[-3:]
        self.assertEqual(sum(map(len, reply)), END.sync_end.bytes)

    def test_header_of_the_empty_payload(self):
        printed = re.search(r"empty payload has the header `([0-9a-f ]+)`", DOCUMENT)[1]
        self.assertEqual(encode_frame(b""), bytes.fromhex(printed))

    def test_block_digest(self):
        printed = re.search(r"The tiles 0/0/0 \(key `(\w+)`\) with hash 1 and 0/1/0 \(`(\w+)`\) with hash 2 are block "
                            r"`(\w+)`, mask (\d+),\s+digest `(\w+)`", DOCUMENT)
        first, second, block, mask, digest = (int(number, 0) for number in printed.groups())
        self.assertEqual((geometry.tile_key(0, 0, 0), geometry.tile_key(0, 1, 0)), (first, second))
        self.assertEqual({geometry.block_of(first), geometry.block_of(second)}, {block})
        self.assertEqual(1 << geometry.index_in_block(first) | 1 << geometry.index_in_block(second), mask)
        self.assertEqual(block_digest([(first, 1), (second, 2)]), digest)

    def test_keys_come_back(self):
        for place in ((0, 0, 0), (7, -1, 2), (15, 2**28 - 1, -2**28)):
            self.assertEqual(geometry.tile_place(geometry.tile_key(*place)), place)


class FrameReaderTest(unittest.TestCase):

    def test_bytes_come_one_by_one(self):
        reader = FrameReader()
        stream = encode_frame(b"one") + encode_frame(b"") + encode_frame(b"three")
        self.assertEqual([payload for i in range(len(stream)) for payload in reader.feed(stream[i:i + 1])],
                         [b"one", b"", b"three"])
        reader.finish()

    def test_refuses_at_the_first_wrong_byte(self):
        with self.assertRaises(BadMagic):
            list(FrameReader().feed(b"RAG"))

    def test_refuses_another_checksum(self):
        frame = bytearray(encode_frame(b"payload"))
        frame[-1] ^= 1
        with self.assertRaises(BadChecksum):
            list(FrameReader().feed(bytes(frame)))

    def test_refuses_a_length_before_its_payload_comes(self):
        with self.assertRaises(FrameTooLong):
            list(FrameReader().feed(b"RAF1" + struct.pack("<II", MAX_PAYLOAD_BYTES + 1, 0)))
        with self.assertRaises(FrameTooLong):
            encode_frame(b"12345", limit_bytes=4)

    def test_tells_an_end_within_a_frame(self):
        frame = encode_frame(b"payload")
        for cut in (1, 12, len(frame) - 1):
            reader = FrameReader()
            self.assertEqual(list(reader.feed(frame[:cut])), [])
            with self.assertRaises(FrameCut):
                reader.finish()


if __name__ == "__main__":
    unittest.main()
