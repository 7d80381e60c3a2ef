"""The benchmark of deploy/bench.sh on how soon a daemon serves again that was killed at work, with an atlas of 1 GiB.
Docs/results.md, "Long runs"."""

import contextlib
import itertools
import os
import random
import statistics
import time
import urllib.error
import urllib.request

import atlas_pb2
from roadatlas import AtlasClient, geometry

from bench_asked import Asked
from bench_daemon import Atlas, rows_of
from bench_memory import NTH
from bench_traffic import Actor, Failures, record_street

STORE_MIB = 1024
KILLS = 10  # of each kind
ASKED_S = 2
VEHICLES = 4
ON_THEIR_WAY = 8  # keyframes of each
FUSED_WITHIN_MS = 3_600_000
PATIENCE_S = 120
PERIOD_S = 0.5  # between uploads of a vehicle: fusion is not to fall behind without end
AT_WORK_S = (0.5, 2.0)  # between these it is killed, once all are at work


def bench_restart(bin_dir, emit, drive):
    """From exec to the answer of /readyz and to the first tile, after SIGKILL amid uploads and fusion; with the atlas
    in the system's cache and without."""
    street = record_street(bin_dir)
    with Asked(emit) as asked, Atlas(bin_dir) as atlas:
        *_, filled = rows_of(bin_dir / "memory_bench", "fill", atlas.server, drive("kitti_0005"), STORE_MIB, NTH)
        asked.at_least("restart.store", filled["store_bytes"] / 2**20, "MiB", STORE_MIB)
        with AtlasClient(port=int(atlas.port)) as client:
            client.upload_keyframes(keyframe.upload("base", "street", i) for i, keyframe in enumerate(street))
            client.wait(FUSED_WITHIN_MS)
        runs = {"warm": [], "cold": []}
        for number in range(2 * KILLS):
            kind = ("warm", "cold")[number % 2]
            at_kill = kill_at_work(atlas, street, number)
            if kind == "cold":
                leave_cache(atlas.database.parent)
            runs[kind].append({**at_kill, **start(atlas, street)})
        for kind, rows in runs.items():
            emit_runs(asked, emit, f"restart.{kind}", rows)


def kill_at_work(atlas, street, number):
    """What was under way."""
    failures = Failures()
    with contextlib.ExitStack() as stack:
        for i in range(VEHICLES):
            act = vehicle_act(street, i, f"late.{number}")
            stack.enter_context(Actor(atlas.port, failures, f"car.{i}", PERIOD_S, act))
        wait_until_at_work(atlas)
        time.sleep(random.uniform(*AT_WORK_S))
        row = {"in_flight": atlas.metric("roadatlas_requests_in_flight"),
               "dirty_tiles": atlas.metric("roadatlas_dirty_tiles")}
        atlas.kill()
    row["log_mib"] = atlas.database.with_name("atlas.db-wal").stat().st_size / 2**20
    return row


def vehicle_act(street, vehicle, session):
    """Some of the street's keyframes at once, each time through it as another session."""
    batches = [range(first, first + ON_THEIR_WAY) for first in range(0, len(street) - ON_THEIR_WAY + 1, ON_THEIR_WAY)]
    turns = itertools.count()

    def act(client):
        lap, batch = divmod(next(turns), len(batches))
        client.upload_keyframes(street[i].upload(f"car.{vehicle}", f"{session}.{lap}", i) for i in batches[batch])
    return act


def wait_until_at_work(atlas):
    until, built = time.monotonic() + PATIENCE_S, atlas.metric("roadatlas_fusion_tiles_total")
    while not (atlas.metric("roadatlas_requests_in_flight") and atlas.metric("roadatlas_dirty_tiles")
               and atlas.metric("roadatlas_fusion_tiles_total") > built):
        if time.monotonic() > until:
            raise RuntimeError("nobody uploads, or nothing is fused")
        time.sleep(0.02)


def leave_cache(folder):
    """Everything that the daemon kept; what others have in the system's cache stays."""
    for path in (path for path in folder.rglob("*") if path.is_file()):
        with open(path, "rb") as file:
            os.fsync(file.fileno())
            os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def start(atlas, street):
    began = time.monotonic()
    atlas.start()
    while not is_ready(atlas):
        if time.monotonic() > began + PATIENCE_S:
            raise RuntimeError("the daemon does not say that it is ready")
        time.sleep(0.002)
    ready_s = time.monotonic() - began
    place = street[0].pose
    with AtlasClient(port=int(atlas.port)) as client:
        reply = client.query_region(atlas_pb2.QueryRegion(
            disc=atlas_pb2.QueryRegion.Disc(x_um=place.x_um, y_um=place.y_um, radius_um=geometry.micrometres(1)),
            coarsest_level=1, only_finest=True))
    if not reply.tiles:
        raise RuntimeError("there is no tile where the street begins")
    return {"ready_s": ready_s, "first_tile_s": time.monotonic() - began}


def is_ready(atlas):
    try:
        with urllib.request.urlopen(f"http://{atlas.http}/readyz", timeout=10) as page:
            return page.status == 200
    except urllib.error.HTTPError:
        return False


def emit_runs(asked, emit, name, rows):
    for key in ("ready_s", "first_tile_s"):
        times = [row[key] for row in rows]
        emit(f"{name}.{key}.median", statistics.median(times), f"s from exec, {len(rows)} kills", "none", None)
        asked.at_most(f"{name}.{key}.worst", max(times), f"s from exec, {len(rows)} kills", ASKED_S)
    for key, unit in (("in_flight", "requests when it was killed"), ("dirty_tiles", "when it was killed"),
                      ("log_mib", "MiB of log that it left")):
        emit(f"{name}.{key}", statistics.median(row[key] for row in rows), f"{unit}, median", "none", None)


BENCHMARKS = {"restart": bench_restart}
