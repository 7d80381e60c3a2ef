#!/usr/bin/python3
"""Handshake, versions, unknown fields, broken frames, pipelining and deadlines against a real daemon."""

import struct
import unittest

import atlas_pb2
from roadatlas import AtlasClient, Code, RequestRefused
from roadatlas.errors import BadMagic, BrokenReply, ConnectionLost, DeadlinePassed, FrameCut
from roadatlas.framing import MAX_HELLO_BYTES, MAX_PAYLOAD_BYTES, encode_frame
from support import AtlasCase, Peer

UNKNOWN_VARINT = b"\xf8\x3f\x01"  # field 1023
UNKNOWN_GROUP = b"\xfb\x3f\xfc\x3f"
UNKNOWN_BODY = b"\xfa\x3f\x00"
MAX_UNKNOWN_FIELDS = 1024


def payload_of(request_id=7, **body):
    return atlas_pb2.Envelope(request_id=request_id, **body).SerializeToString()


HELLO = encode_frame(payload_of(1, hello=atlas_pb2.Hello(protocol_major=1)))
STATUS = payload_of(status_request=atlas_pb2.StatusRequest())


class HandshakeTest(AtlasCase):

    def test_says_who_it_is(self):
        hello = self.client.hello
        self.assertEqual((hello.protocol_major, len(hello.atlas_id), hello.max_frame_bytes),
                         (1, 16, MAX_PAYLOAD_BYTES))
        self.assertEqual(self.connect(profile=hello.profile).hello, hello)

    def test_refuses_another_major_version(self):
        for major in (0, 2):
            self.refused(Code.UNSUPPORTED, self.connect, protocol_major=major, says="version")

    def test_refuses_another_profile(self):
        profile = bytearray(self.client.hello.profile)
        profile[1] ^= 1  # the size of a cell
        self.refused(Code.INVALID_DATA, self.connect, profile=bytes(profile))
        profile[0] += 1  # the version
        self.refused(Code.UNSUPPORTED, self.connect, profile=bytes(profile))

    def test_first_frame_must_be_a_hello(self):
        answers = self.talk(encode_frame(STATUS) + encode_frame(STATUS))
        self.assertEqual([(answer.request_id, answer.error.code) for answer in answers], [(7, Code.INVALID_DATA)])

    def test_second_hello_is_refused_and_the_connection_goes_on(self):
        answers = self.talk(HELLO + HELLO + encode_frame(STATUS))
        self.assertEqual([answer.WhichOneof("body") for answer in answers], ["hello_reply", "error", "status_reply"])
        self.assertEqual(answers[1].error.code, Code.INVALID_ARGUMENT)

    def test_is_told_when_nobody_listens(self):
        with Peer(b"\0") as peer:
            port = peer.port
            with self.assertRaises(BadMagic):
                AtlasClient(port=port)
        with self.assertRaises(ConnectionLost):
            AtlasClient(port=port)


class BrokenFrameTest(AtlasCase):

    def assert_closes(self, data):
        """After the handshake: one Error with request id 0, then the end, whatever follows."""
        greeted, *answers = self.talk(HELLO + data + encode_frame(STATUS))
        self.assertEqual(greeted.WhichOneof("body"), "hello_reply")
        self.assertEqual([(answer.request_id, answer.error.code) for answer in answers], [(0, Code.INVALID_DATA)])

    def test_garbage(self):
        self.assert_closes(b"GET / HTTP/1.1\r\n\r\n")
        answers = self.talk(b"GET / HTTP/1.1\r\n\r\n")
        self.assertEqual([(answer.request_id, answer.error.code) for answer in answers], [(0, Code.INVALID_DATA)])

    def test_another_checksum(self):
        self.assert_closes(encode_frame(STATUS)[:-1] + b"\xff")

    def test_too_long(self):
        self.assert_closes(b"RAF1" + struct.pack("<II", MAX_PAYLOAD_BYTES + 1, 0))
        answer, = self.talk(b"RAF1" + struct.pack("<II", MAX_HELLO_BYTES + 1, 0))
        self.assertEqual((answer.request_id, answer.error.code), (0, Code.INVALID_DATA))

    def test_no_envelope(self):
        self.assert_closes(encode_frame(b"\xff\xff\xff"))

    def test_groups(self):
        self.assert_closes(encode_frame(STATUS + UNKNOWN_GROUP))

    def test_too_many_unknown_fields(self):
        self.assert_closes(encode_frame(STATUS + UNKNOWN_VARINT * (MAX_UNKNOWN_FIELDS + 1)))

    def test_client_hears_why(self):
        with self.assertRaises(BrokenReply), Peer(encode_frame(b"\xff\xff\xff")) as peer:
            AtlasClient(port=peer.port)
        with self.assertRaises(FrameCut), Peer(HELLO[:-1]) as peer:
            AtlasClient(port=peer.port)
        for answer in (HELLO, encode_frame(payload_of(9, hello_reply={})), encode_frame(payload_of(1))):
            with self.assertRaises(BrokenReply), Peer(answer) as peer:
                AtlasClient(port=peer.port)


class ErrorTest(unittest.TestCase):

    def error(self, request_id, **fields):
        """What the client makes of an Error in place of its first reply."""
        error = {"code": 5, "message": "busy", "retry": True, "retry_after_ms": 250, **fields}
        with self.assertRaises(RequestRefused) as caught:
            with Peer(encode_frame(payload_of(request_id, error=error))) as peer:
                AtlasClient(port=peer.port)
        return caught.exception

    def test_says_when_to_try_again(self):
        for request_id in (1, 0):
            error = self.error(request_id)
            self.assertEqual((error.request_id, error.code, error.message, error.retry, error.retry_after_ms),
                             (request_id, Code.UNAVAILABLE, "busy", True, 250))

    def test_says_what_the_code_does_not(self):
        self.assertEqual(self.error(1, code=7, reason="quota").reason, "quota")
        self.assertEqual(self.error(1).reason, "")

    def test_unknown_code_is_internal(self):
        self.assertEqual(self.error(1, code=77).code, Code.INTERNAL)


class BrokenSyncTest(unittest.TestCase):

    def test_tiles_are_those_that_a_manifest_announced(self):
        manifest = {"sync_manifest": {"keys": [1], "revisions": [2], "payload_hashes": [3], "bytes": [1]}}
        tile = {"tile": {"key": 1, "revision": 2, "payload_hash": 3, "blob": b"x"}}
        other = {"tile": {"key": 1, "revision": 2, "payload_hash": 4, "blob": b"x"}}
        delta = {"tile": {**tile["tile"], "base_hash": 5}}
        end = {"sync_end": {"tiles": 1}}
        for bodies in ([tile], [end], [manifest, end], [manifest, other], [manifest, delta],
                       [manifest, tile, tile], [manifest, manifest]):
            with self.assertRaises(BrokenReply):
                self.sync(bodies)
        self.assertEqual(len(self.sync([manifest, tile, end]).tiles), 1)

    @staticmethod
    def sync(bodies):
        greeting = encode_frame(payload_of(1, hello_reply={}))
        reply = b"".join(encode_frame(payload_of(2, **body)) for body in bodies)
        with Peer(greeting, reply) as peer, AtlasClient(port=peer.port) as client:
            return client.sync(atlas_pb2.SyncRequest())


class RequestTest(AtlasCase):

    def test_unknown_fields_are_ignored(self):
        answers = self.talk(HELLO + encode_frame(STATUS + UNKNOWN_VARINT * MAX_UNKNOWN_FIELDS))
        self.assertEqual(answers[-1].status_reply.revision, 0)
        self.assertEqual(answers[-1].WhichOneof("body"), "status_reply")

    def test_unknown_body_is_unsupported_and_the_connection_goes_on(self):
        _, refused, answered = self.talk(HELLO + encode_frame(payload_of(5) + UNKNOWN_BODY) + encode_frame(STATUS))
        self.assertEqual((refused.request_id, refused.error.code), (5, Code.UNSUPPORTED))
        self.assertEqual(answered.WhichOneof("body"), "status_reply")

    def test_requests_go_out_before_replies_come(self):
        asked = {self.client.submit(atlas_pb2.SessionsRequest() if i % 2 else atlas_pb2.StatusRequest()): i
                 for i in range(200)}
        for request_id, i in reversed(asked.items()):
            reply = self.client.result(request_id)
            self.assertIsInstance(reply, atlas_pb2.SessionsReply if i % 2 else atlas_pb2.StatusReply)

    def test_deadline_gives_up_one_request_and_not_the_connection(self):
        client = self.connect(timeout_s=2)
        with self.stopped_daemon(), self.assertRaises(DeadlinePassed):
            client.status()
        self.assertEqual(self.client.status().keyframes, 0)
        request_id = client.submit(atlas_pb2.SessionsRequest())
        self.assertIsInstance(client.result(request_id, timeout_ms=30_000), atlas_pb2.SessionsReply)

    def test_silent_peer_misses_the_deadline_of_the_handshake(self):
        with self.assertRaises(DeadlinePassed), Peer() as peer:
            AtlasClient(port=peer.port, timeout_s=0.2)

    def test_daemon_that_stopped_is_told(self):
        self.daemon.stop()
        with self.assertRaises(ConnectionLost):
            self.client.status()


if __name__ == "__main__":
    unittest.main()
