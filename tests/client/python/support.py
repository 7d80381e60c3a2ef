"""What the tests share: a daemon of their own with a small drive, its map as a query tells it, a peer that misbehaves.

The environment gives ATLAS_BIN_DIR, and PYTHONPATH for the client and the messages made from atlas.proto.
"""

import contextlib
import functools
import os
import pathlib
import signal
import socket
import sys
import tempfile
import threading
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests/client/support"))

import atlas_pb2
import keyframes
from harness import SMALL, Daemon
from roadatlas import AtlasClient, Code, RequestRefused
from roadatlas import geometry
from roadatlas.framing import FrameReader, encode_frame
from roadatlas.profile import parse_profile

BIN_DIR = pathlib.Path(os.environ["ATLAS_BIN_DIR"])
HEIGHT_M = 1.8
START_MS = 1_700_000_000_000
RADIUS_CELLS = 60
FUSED_WITHIN_MS = 120_000
EVERYWHERE = geometry.disc(150, 0, 500)


class AtlasCase(unittest.TestCase):
    """A daemon of its own for each test, and what it needs in the folder `work`."""

    def setUp(self):
        self.work = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.start_daemon()
        self.profile = parse_profile(self.client.hello.profile)

    def flags(self):
        """More of them for the daemon."""
        return ()

    def start_daemon(self):
        """On the atlas of the one before, if that was stopped."""
        self.daemon = self.enterContext(Daemon(BIN_DIR, self.work / "atlas", *SMALL, *self.flags()))
        self.host, port = self.daemon.server.rsplit(":", 1)
        self.port = int(port)
        self.client = self.connect()

    def connect(self, **options):
        return self.enterContext(AtlasClient(self.host, self.port, **options))

    def upload(self, sequence, x_m, session="near", radius_cells=RADIUS_CELLS, bump_mm=0):
        return atlas_pb2.UploadKeyframe(
            key=key(sequence, session), time_ms=START_MS + 1000 * sequence, pose=pose_at(x_m),
            blob=road_blob(radius_cells, bump_mm, self.profile.hash, self.profile.cell_size_um))

    @contextlib.contextmanager
    def stopped_daemon(self):
        """It does nothing at all as long as that lasts."""
        self.daemon.process.send_signal(signal.SIGSTOP)
        try:
            _wait_until_stopped(self.daemon.process.pid)  # else it may still answer
            yield
        finally:
            self.daemon.process.send_signal(signal.SIGCONT)

    def drive(self):
        """Eight keyframes along a road, and three of another session further on; all fused."""
        self.client.upload_keyframes([self.upload(i, 8 * i) for i in range(8)]
                                     + [self.upload(i, 300 + 8 * i, "far") for i in range(3)])
        self.fuse()

    def fuse(self):
        self.assertFalse(self.client.wait(FUSED_WITHIN_MS).timed_out)

    def map_now(self):
        """All tiles, by key."""
        return {tile.key: tile for tile in self.client.query_region(atlas_pb2.QueryRegion()).tiles}

    def refused(self, code, call, *args, says="", **kwargs):
        with self.assertRaises(RequestRefused) as caught:
            call(*args, **kwargs)
        self.assertEqual((caught.exception.code, caught.exception.retry), (code, code in RETRY))
        self.assertIn(says, caught.exception.message)

    def assert_usable(self, tiles, coarsest_level):
        """Cut after any tile it is a map: a tile comes after its parent."""
        came = set()
        for tile in tiles:
            if geometry.tile_place(tile.key)[0] < coarsest_level:
                self.assertIn(geometry.parent_key(tile.key), came)
            came.add(tile.key)

    def talk(self, data):
        """What the daemon answers to these bytes until it closes; the sending side is closed behind them."""
        with socket.create_connection((self.host, self.port), timeout=30) as peer:
            peer.sendall(data)
            peer.shutdown(socket.SHUT_WR)
            reader = FrameReader()
            answers = []
            while received := peer.recv(1 << 16):
                answers += [atlas_pb2.Envelope.FromString(payload) for payload in reader.feed(received)]
            reader.finish()
            return answers


RETRY = (Code.UNAVAILABLE, Code.TIMEOUT, Code.RESOURCE_EXHAUSTED)


def _wait_until_stopped(pid):
    """Every thread of the process (proc(5): the state is behind the name in brackets)."""
    tasks = pathlib.Path(f"/proc/{pid}/task")
    while any((task / "stat").read_text().rpartition(") ")[2][0] != "T" for task in tasks.iterdir()):
        time.sleep(0.001)


def frame_of(request_id, **body):
    return encode_frame(atlas_pb2.Envelope(request_id=request_id, **body).SerializeToString())


@functools.cache
def road_blob(radius_cells, bump_mm, profile_hash, cell_size_um):
    return keyframes.encode_keyframe(keyframes.road(radius_cells, bump_mm), profile_hash, cell_size_um)


def key(sequence, session="near"):
    return atlas_pb2.KeyframeKey(vehicle="car", session=session, sequence=sequence)


def pose_at(x_m, z_m=HEIGHT_M):
    return geometry.pose((x_m, 0, z_m))


def hashes(tiles):
    return {tile_key: tile.payload_hash for tile_key, tile in tiles.items()}


class Peer:
    """Listens on a free port and accepts once. Answers what comes first with the first bytes, and so on, and ends
    its side; without any it stays silent."""

    def __init__(self, *answers):
        self._answers = answers
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._thread = threading.Thread(target=self._serve)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._thread.join()
        self._listener.close()

    def _serve(self):
        with self._listener.accept()[0] as peer:
            peer.settimeout(30)
            for answer in self._answers:
                peer.recv(1 << 16)
                peer.sendall(answer)
            if self._answers:
                peer.shutdown(socket.SHUT_WR)
            while peer.recv(1 << 16):
                pass
