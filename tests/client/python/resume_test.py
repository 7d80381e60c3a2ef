#!/usr/bin/python3
"""Uploads of a session that go on where the daemon has them, through a connection that breaks."""

import functools
import socket
import threading
import time
import unittest
import unittest.mock

import atlas_pb2
from roadatlas import AtlasClient, Code, OtherAtlas, RequestRefused, SessionUploader
from roadatlas.errors import ConnectionLost
from roadatlas.framing import FrameReader
from support import AtlasCase, key

COUNT = 40
PAUSE_S = 0.05


class Cutting:
    """Stands between a client and the daemon and passes on so many bytes of the client's on each connection, then
    cuts it; None: all. Keeps which keyframes were passed on whole."""

    def __init__(self, daemon, *limits, before_connection=lambda passed: None):
        self._daemon = daemon
        self._limits = limits
        self._before_connection = before_connection
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(60)
        self.port = self._listener.getsockname()[1]
        self.passed = []
        self._thread = threading.Thread(target=self._serve)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._thread.join()
        self._listener.close()

    def _serve(self):
        for limit in self._limits:
            with self._listener.accept()[0] as client:
                self._before_connection(len(set(sum(self.passed, []))))
                with socket.create_connection(self._daemon, timeout=60) as daemon:
                    client.settimeout(60)
                    self._pass_on(client, daemon, limit)

    def _pass_on(self, client, daemon, limit):
        back = threading.Thread(target=self._pass_back, args=(daemon, client))
        back.start()
        passed = 0
        reader = FrameReader()
        keyframes = []
        while (limit is None or passed < limit) and (data := client.recv(1 << 16 if limit is None else limit - passed)):
            daemon.sendall(data)
            passed += len(data)
            envelopes = [atlas_pb2.Envelope.FromString(payload) for payload in reader.feed(data)]
            keyframes += [envelope.upload_keyframe.key.sequence for envelope in envelopes
                          if envelope.HasField("upload_keyframe")]
        self.passed.append(keyframes)
        daemon.shutdown(socket.SHUT_WR)
        back.join()

    @staticmethod
    def _pass_back(daemon, client):
        try:
            while data := daemon.recv(1 << 16):
                client.sendall(data)
        except ConnectionError:
            pass  # the client left


class ResumeTest(AtlasCase):

    def setUp(self):
        super().setUp()
        self.uploads = [self.upload(i, i, radius_cells=8) for i in range(COUNT)]

    def uploader(self, port=None, **options):
        connect = functools.partial(AtlasClient, "127.0.0.1", port or self.port, timeout_s=60)
        return SessionUploader(connect, "car", "near", first_pause_s=PAUSE_S, **options)

    def last_sequence(self, session):
        return self.connect(resume=("car", session)).last_sequence

    def test_says_what_is_there(self):
        self.assertIsNone(self.client.last_sequence)
        self.assertIsNone(self.last_sequence("near"))
        self.client.upload_keyframe(self.upload(0, 0, radius_cells=8))
        self.assertEqual(self.last_sequence("near"), 0)
        self.client.upload_keyframe(self.upload(7, 0, radius_cells=8))
        self.assertEqual([self.last_sequence(session) for session in ("near", "far", "a b")], [7, None, None])

    def test_goes_on_behind_what_is_there(self):
        self.client.upload_keyframes(self.uploads[:10])
        report = self.uploader().upload(reversed(self.uploads))
        self.assertEqual((report.there_already, report.acknowledged, report.refused),
                         (list(range(10)), list(range(10, COUNT)), {}))
        again = self.uploader().upload(self.uploads)
        self.assertEqual((again.there_already, again.acknowledged), (list(range(COUNT)), []))

    def test_who_only_rises_sends_nothing_twice(self):
        self.client.upload_keyframes(self.uploads[:10])
        with Cutting((self.host, self.port), None) as between:
            report = self.uploader(between.port, rising=True).upload(self.uploads)
        self.assertEqual((report.there_already, report.acknowledged), (list(range(10)), list(range(10, COUNT))))
        self.assertEqual(between.passed, [list(range(10, COUNT))])

    def test_what_lies_before_is_sent(self):
        """Another call, or program, had higher numbers: that says nothing of these, whenever the connection breaks."""
        self.assertEqual(self.uploader().upload(self.uploads[10:15]).acknowledged, list(range(10, 15)))
        cut = 2 * self.uploads[0].ByteSize() + 100
        with Cutting((self.host, self.port), cut, None, before_connection=self.settle_after(5)) as between:
            report = self.uploader(between.port).upload(self.uploads[:5] + self.uploads[20:])
        self.assertEqual(sorted(report.acknowledged + report.there_already), [*range(5), *range(20, COUNT)])
        self.assertTrue(set(range(2, 5)) <= set(report.acknowledged))
        self.assertEqual(self.client.status().keyframes, 10 + COUNT - 20)

    def settle_after(self, stored):
        return lambda passed: self.settle(stored + passed)

    def test_nothing_is_sent_twice_after_the_connection_dropped(self):
        """Cut within the 16th keyframe: the daemon has fifteen, of which the client may know of fewer."""
        frame_bytes = self.uploads[20].ByteSize()
        cut = 15 * frame_bytes + frame_bytes // 2
        with Cutting((self.host, self.port), cut, None, before_connection=self.settle) as between:
            report = self.uploader(between.port, rising=True).upload(self.uploads)
        self.assertEqual(report.refused, {})
        self.assertEqual(sorted(report.acknowledged + report.there_already), list(range(COUNT)))
        there = len(between.passed[0])
        self.assertTrue(10 < there < 20)
        self.assertEqual(between.passed, [list(range(there)), list(range(there, COUNT))])
        self.assertEqual(self.client.status().keyframes, COUNT)

    def settle(self, passed):
        """Until the daemon has stored what reached it."""
        until = time.monotonic() + 60
        while self.client.status().keyframes < passed:
            self.assertLess(time.monotonic(), until)
            time.sleep(0.05)

    def test_breaks_again_and_again(self):
        size = self.uploads[20].ByteSize()
        limits = [12 * size + 7 * i for i in range(3)]
        with Cutting((self.host, self.port), *limits, None, before_connection=self.settle) as between:
            report = self.uploader(between.port, rising=True).upload(self.uploads)
        self.assertEqual(sorted(report.acknowledged + report.there_already), list(range(COUNT)))
        self.assertEqual(sum(between.passed, []), list(range(COUNT)))
        self.assertEqual((self.client.status().keyframes, len(between.passed)), (COUNT, 4))

    def test_gives_up_when_nothing_goes_forward(self):
        with Cutting((self.host, self.port), *3 * [40]) as between:
            with self.assertRaises(ConnectionLost):
                self.uploader(between.port, attempts=3).upload(self.uploads)
        self.assertEqual(len(between.passed), 3)
        self.daemon.stop()
        with self.assertRaises(ConnectionLost):
            self.uploader(attempts=2).upload(self.uploads)

    def test_refused_ones_do_not_hold_up_the_others(self):
        self.uploads[3].blob = b"no keyframe"
        report = self.uploader().upload(self.uploads)
        self.assertEqual({sequence: refusal.code for sequence, refusal in report.refused.items()},
                         {3: Code.INVALID_DATA})
        self.assertEqual(report.acknowledged, [i for i in range(COUNT) if i != 3])

    def test_what_will_not_pass_is_raised(self):
        profile = bytearray(self.client.hello.profile)
        profile[1] ^= 1
        connect = functools.partial(AtlasClient, self.host, self.port, profile=bytes(profile))
        self.refused(Code.INVALID_DATA, SessionUploader(connect, "car", "near").upload, self.uploads)
        for wrong in ([self.upload(0, 0, "far", radius_cells=8)], [self.uploads[0], self.uploads[0]]):
            with self.assertRaises(ValueError):
                self.uploader().upload(wrong)
        self.assertEqual(self.client.status().keyframes, 0)


class BusyDaemon:
    """Stands in for AtlasClient: refuses some keyframes at first, and what is behind them until they come again, and
    counts what it was sent."""

    def __init__(self, busy):
        self.busy = set(busy)
        self.missing = set()
        self.taken = []
        self.sent = []
        self.wait_ms = 1  # of those that are busy; what is behind them is told to come in 1 ms

    atlas_id = bytes(16)
    epoch = 1

    def __call__(self, resume):
        self.last_sequence = max(self.taken, default=None)
        self.missing.clear()
        return self

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def submit(self, upload):
        self.sent.append(upload.key.sequence)
        return upload.key.sequence

    def result(self, sequence):
        if sequence in self.busy or min(self.missing, default=sequence) < sequence:
            wait_ms = self.wait_ms if sequence in self.busy else 1
            self.busy.discard(sequence)
            self.missing.add(sequence)
            raise RequestRefused(sequence + 1, Code.UNAVAILABLE, "busy", True, wait_ms)
        self.missing.discard(sequence)
        self.taken.append(sequence)
        return Reply()


class RestoredDaemon(BusyDaemon):
    """Refuses 5 for now, and comes back as it was when it had 0 to 2."""

    def __init__(self):
        super().__init__({5})

    def submit(self, upload):
        if self.epoch == 1 and upload.key.sequence > 5:
            raise ConnectionLost("gone")
        return super().submit(upload)

    def __exit__(self, *_):
        if self.epoch == 1:
            self.epoch = 2
            self.taken = [0, 1, 2]


class ReplacedDaemon(RestoredDaemon):
    """Another atlas comes in its place, which has the same epoch."""

    def __exit__(self, *_):
        if self.atlas_id == bytes(16):
            self.atlas_id = bytes(range(16))
            self.taken = []


class Reply:
    duplicate = False


class PostponedTest(unittest.TestCase):

    def test_refused_for_now_is_sent_again_and_so_is_what_is_behind_it(self):
        daemon = BusyDaemon({2, 5})
        uploads = [self.named(i) for i in range(8)]
        report = SessionUploader(daemon, "car", "near", first_pause_s=0.001).upload(uploads)
        self.assertEqual(daemon.sent, [*range(8), *range(2, 8)])
        self.assertEqual((report.acknowledged, report.refused), (list(range(8)), {}))

    def test_waits_as_long_as_the_daemon_says(self):
        daemon = BusyDaemon({2})
        daemon.wait_ms = 3_600_000
        with unittest.mock.patch("roadatlas.session_uploader.time.sleep") as sleep:
            report = SessionUploader(daemon, "car", "near", first_pause_s=0.001).upload(map(self.named, range(8)))
        self.assertEqual([call.args for call in sleep.call_args_list], [(3600,)])
        self.assertEqual(report.acknowledged, list(range(8)))

    def test_what_was_acknowledged_before_a_restore_is_sent_again(self):
        daemon = RestoredDaemon()
        report = SessionUploader(daemon, "car", "near", rising=True, first_pause_s=0.001).upload(map(self.named, range(8)))
        self.assertEqual(daemon.sent, [*range(6), *range(3, 8)])
        self.assertEqual((report.acknowledged, report.there_already), ([3, 4, 5, 6, 7], [0, 1, 2]))

    def test_another_atlas_is_not_taken_for_the_first_one(self):
        for rising in (False, True):
            daemon = ReplacedDaemon()
            uploader = SessionUploader(daemon, "car", "near", rising=rising, first_pause_s=0.001)
            with self.assertRaises(OtherAtlas):
                uploader.upload(map(self.named, range(8)))
            with self.assertRaises(OtherAtlas):
                uploader.upload([self.named(9)])
            self.assertEqual((daemon.sent, daemon.taken), ([*range(6)], []))

    @staticmethod
    def named(sequence):
        return atlas_pb2.UploadKeyframe(key=key(sequence))


if __name__ == "__main__":
    unittest.main()
