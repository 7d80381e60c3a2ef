"""The benchmark of deploy/bench.sh on the purge of a large session: how long it takes, and who waits for it meanwhile.
Docs/results.md, "Long runs"."""

import contextlib
import itertools
import math
import time

import atlas_pb2
from roadatlas import AtlasClient, TileStore, geometry

from bench_daemon import Atlas
from bench_traffic import Actor, Failures, record_street

KEYFRAMES = 10_000
LANE_UM = 40_000_000  # beside the one before; less than what looks wrong
BEAT_MS = 1000
ALONE_S = 5
FUSED_WITHIN_MS = 600_000
PURGED_WITHIN_S = 600
PAUSE_S = 0.01


class Timed:
    """An act, and how long each took."""

    def __init__(self, act):
        self.act, self.seconds = act, []

    def __call__(self, client):
        began = time.monotonic()
        self.act(client)
        self.seconds.append(time.monotonic() - began)


def bench_purge(bin_dir, emit, drive):
    """10,000 keyframes of one session purged, while somebody reads tiles, the status and the list of sessions, and a
    vehicle uploads. Nothing is fused but a street before."""
    street = record_street(bin_dir)
    with Atlas(bin_dir) as atlas:
        with AtlasClient(port=int(atlas.port)) as client:
            client.upload_keyframes(keyframe.upload("base", "street", i) for i, keyframe in enumerate(street))
            client.wait(FUSED_WITHIN_MS)
        atlas.stop()
        atlas.start("--fusion", "false")
        with AtlasClient(port=int(atlas.port), timeout_s=PURGED_WITHIN_S) as client:
            for lane in range(math.ceil(KEYFRAMES / len(street))):
                client.upload_keyframes(lane_of(street, lane))
            before = client.status()
            emit("purge.store", before.used_bytes / 2**20, "MiB in use", "none", None)
            emit_waits(emit, "purge.alone", waits_beside(atlas, street, "alone", lambda: time.sleep(ALONE_S)))
            began = time.monotonic()
            waits = waits_beside(atlas, street, "beside", lambda: purge(client))
            seconds = time.monotonic() - began
            emit("purge.seconds", seconds, f"s for {KEYFRAMES} keyframes", "none", None)
            emit_waits(emit, "purge.beside", waits)
            emit("purge.log", atlas.database.with_name("atlas.db-wal").stat().st_size / 2**20, "MiB of log behind it",
                 "none", None)


def lane_of(street, lane):
    """The street once more beside the last time, there and back, so that neighbours are neighbours."""
    there = street if lane % 2 == 0 else list(reversed(street))
    first = lane * len(street)
    for i, keyframe in enumerate(there[:KEYFRAMES - first]):
        upload = keyframe.upload("car", "large", first + i, (0, LANE_UM * (lane + 1)))
        upload.time_ms = BEAT_MS * (first + i)
        yield upload


def purge(client):
    reply = client.change_session("car", "large", atlas_pb2.ChangeSession.PURGE, "bench")
    if reply.keyframes != KEYFRAMES:
        raise RuntimeError(f"{reply.keyframes} keyframes were purged")


def waits_beside(atlas, street, session, what):
    """Seconds of each request, by who asked, while `what` lasts."""
    failures = Failures()
    sent = itertools.count()
    around = atlas_pb2.SyncRequest(area=geometry.disc(*street[len(street) // 2].place_m, 30))
    acts = {"uploads": Timed(lambda client: upload_next(client, street, session, next(sent))),
            "tiles": Timed(lambda client: list(TileStore().synchronize(client, around))),
            "status": Timed(lambda client: client.status()),
            "sessions": Timed(lambda client: client.sessions())}
    with contextlib.ExitStack() as stack:
        for name, act in acts.items():
            stack.enter_context(Actor(atlas.port, failures, name, PAUSE_S, act))
        what()
    if failures.others or failures.not_now:
        raise RuntimeError(f"{failures.not_now} not now; {failures.others}")
    return {name: act.seconds for name, act in acts.items()}


def upload_next(client, street, session, number):
    client.upload_keyframe(street[number % len(street)].upload("other", f"{session}.{number // len(street)}", number))


def emit_waits(emit, name, waits):
    for who, seconds in waits.items():
        seconds = sorted(seconds)
        emit(f"{name}.{who}.p50", 1000 * seconds[len(seconds) // 2], f"ms, of {len(seconds)}", "none", None)
        emit(f"{name}.{who}.max", 1000 * seconds[-1], "ms", "none", None)


BENCHMARKS = {"purge": bench_purge}
