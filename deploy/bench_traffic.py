"""Requests beside what is measured, from the client in Python: the keyframes of a drive, made before, and actors that
do one thing again and again, each on a thread and a connection of its own. What goes wrong is kept."""

import contextlib
import dataclasses
import pathlib
import sqlite3
import subprocess
import tempfile
import threading

import atlas_pb2
from roadatlas import AtlasClient, Code, RequestRefused, RoadAtlasError

from bench_daemon import Atlas, Background

NOT_NOW = (Code.UNAVAILABLE, Code.RESOURCE_EXHAUSTED)  # busy, or no room: typed, and to be tried again


@dataclasses.dataclass(frozen=True)
class Recorded:
    """A keyframe as somebody uploaded it."""

    time_ms: int
    pose: atlas_pb2.Pose
    blob: bytes

    def upload(self, vehicle, session, sequence, shift_um=(0, 0)):
        """It again under another name, at another place if asked for."""
        upload = atlas_pb2.UploadKeyframe(time_ms=self.time_ms, pose=self.pose, blob=self.blob)
        upload.key.CopyFrom(atlas_pb2.KeyframeKey(vehicle=vehicle, session=session, sequence=sequence))
        upload.pose.x_um += shift_um[0]
        upload.pose.y_um += shift_um[1]
        return upload

    @property
    def place_m(self):
        return self.pose.x_um / 1e6, self.pose.y_um / 1e6


def record_street(bin_dir):
    """The keyframes of the simulated street, 1.3 m apart, in the order of the drive."""
    with tempfile.TemporaryDirectory() as folder, Atlas(bin_dir, "--fusion", "false") as atlas:
        street = pathlib.Path(folder) / "street"
        subprocess.run([bin_dir / "atlas", "simulate", "street", "-o", street], check=True, stdout=subprocess.DEVNULL)
        atlas.run("ingest", street)
        atlas.stop()
        with contextlib.closing(sqlite3.connect(atlas.database)) as database:
            rows = database.execute("SELECT time_ms, x_um, y_um, z_um, qw, qx, qy, qz, blob FROM keyframes "
                                    "JOIN poses ON keyframe_id = id ORDER BY id").fetchall()
    names = ("x_um", "y_um", "z_um", "qw", "qx", "qy", "qz")
    return [Recorded(time_ms, atlas_pb2.Pose(**dict(zip(names, pose))), blob) for time_ms, *pose, blob in rows]


class Failures:
    """Of all actors. Those that say "not now" are counted by themselves."""

    def __init__(self):
        self.not_now, self.others, self.lock = 0, [], threading.Lock()

    @contextlib.contextmanager
    def noted(self, who):
        try:
            yield
        except RequestRefused as refusal:
            self.note(who, refusal, refusal.code in NOT_NOW)
        except (RoadAtlasError, OSError) as error:
            self.note(who, error, False)

    def note(self, who, error, is_not_now):
        with self.lock:
            if is_not_now:
                self.not_now += 1
            else:
                self.others.append(f"{who}: {type(error).__name__}: {error}")


class Actor(Background):
    """Calls `act` with a client, every `period_s`, until it is told to stop; without a pause for 0. Connects again when
    the connection is lost."""

    def __init__(self, port, failures, name, period_s, act):
        super().__init__(name)
        self.port, self.failures, self.name, self.period_s, self.act = int(port), failures, name, period_s, act
        self.acts = 0

    def run(self):
        while not self.is_over.is_set():
            with self.failures.noted(self.name), AtlasClient(port=self.port, client_name=self.name) as client:
                self.act_on(client)
            self.is_over.wait(0.1)

    def act_on(self, client):
        while not self.is_over.wait(self.period_s):
            try:
                self.act(client)
                self.acts += 1
            except RequestRefused as refusal:
                if refusal.code not in NOT_NOW or refusal.request_id == 0:
                    raise
                self.failures.note(self.name, refusal, True)
