"""The benchmarks of deploy/bench.sh on a daemon that does several things at once: reads while vehicles
upload, uploads alone, and a crowd of connections. Docs/results.md, "Serving"."""

import contextlib
import json
import os
import pathlib
import statistics
import subprocess
import tempfile
import time

from bench_daemon import Atlas, Certificate, rows_of
from bench_newcomers import emit_newcomers
from bench_serving import CONNECTIONS, ROUNDS, THREADS, fill, write_tile_files

ROUND_MS = 3000
LONG_ROUND_MS = 30_000  # in which the map's age settles
VEHICLES = 4
WORKERS = 2

UPLOADS = 1024  # keyframes a round, all connections together

IDLE, SLOW, HOSTILE = 1000, 1000, 50


class Beside:
    """A program that runs beside what is measured, and has failed if it says so."""

    def __init__(self, *command):
        self.process = subprocess.Popen([str(part) for part in command], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True)
        self.ready = self.row()

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        if kind:
            self.process.kill()
        self.process.stdin.close()
        self.process.wait()

    def row(self):
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError(f"{self.process.args[0]} ended with {self.process.wait()}")
        return json.loads(line)

    def end(self):
        """Its last row."""
        self.process.stdin.close()
        row = self.row()
        if self.process.wait():
            raise RuntimeError(f"{self.process.args[0]} ended with {self.process.returncode}")
        return row


def stored_keyframes(bin_dir, drive, folder):
    """The database of a daemon that has ended, with the keyframes of all drives."""
    with Atlas(bin_dir) as atlas:
        fill(atlas, drive)
        atlas.stop()
        target = pathlib.Path(folder) / "keyframes.db"
        os.replace(atlas.database, target)
    return target


def load(bin_dir, port, folder, case, number, *, connections=CONNECTIONS, tls=False, round_ms=ROUND_MS):
    row, = rows_of(bin_dir / "serving_bench", "load", port, folder, case, connections, number, round_ms,
                   *(["tls"] if tls else []))
    return row


def alternate(number, first, second):
    """What both return, each before the other in every second round."""
    if number % 2:
        return tuple(reversed((second(), first())))
    return first(), second()


def ratio(pairs, key):
    return statistics.median(busy[key] / idle[key] for idle, busy in pairs)


def of_busy(pairs, key):
    return statistics.median(busy[key] for _, busy in pairs)


def bench_reads(bin_dir, emit, drive):
    """One tile a request on 16 connections, while nothing else happens and while four vehicles upload."""
    with tempfile.TemporaryDirectory() as folder:
        keyframes = stored_keyframes(bin_dir, drive, folder)
        for name, per_s, options in (("fleet", 1, ()), ("catching_up", 10, ()),
                                     ("fleet.nice_19", 1, ("--fusion-nice", "19")),
                                     ("catching_up.nice_19", 10, ("--fusion-nice", "19"))):
            with Atlas(bin_dir, "--network-threads", str(THREADS), "--workers", str(WORKERS), *options) as atlas:
                fill(atlas, drive)
                emit_reads(emit, f"reads.{name}", list(read_rounds(bin_dir, atlas, keyframes, per_s)))
                emit_age(emit, f"reads.{name}", bin_dir, atlas, keyframes, per_s)


def read_rounds(bin_dir, atlas, keyframes, per_s):
    with tempfile.TemporaryDirectory() as tiles:
        write_tile_files(bin_dir, atlas, tiles)
        for number in range(-1, ROUNDS):  # the first one warms up
            pair = alternate(number, lambda: idle_reads(bin_dir, atlas, tiles, number),
                             lambda: busy_reads(bin_dir, atlas, tiles, number, keyframes, per_s))
            if number >= 0:
                yield pair


def idle_reads(bin_dir, atlas, tiles, number):
    atlas.run("wait")
    return load(bin_dir, atlas.port, tiles, "single", number)


def busy_reads(bin_dir, atlas, tiles, number, keyframes, per_s, *, round_ms=ROUND_MS, options=()):
    atlas.run("wait")
    seconds = round_ms // 1000 + 2  # before, and behind
    with Beside(bin_dir / "upload_bench", "send", keyframes, atlas.port, f"round.{number}", VEHICLES,
                seconds * per_s, per_s, *options) as fleet:
        time.sleep(1)
        began, before = time.monotonic(), fusion_figures(atlas)
        row = load(bin_dir, atlas.port, tiles, "single", number, round_ms=round_ms)
        fused_s, row["tiles_built"] = (now - then for now, then in zip(fusion_figures(atlas), before))
        row["workers_busy"] = fused_s / (time.monotonic() - began)
        row.update(fleet.end())
    return row


def fusion_figures(atlas):
    return [atlas.metric(f"roadatlas_fusion_{what}_total") for what in ("seconds", "tiles")]


def emit_reads(emit, name, pairs):
    rate = of_busy(pairs, "tiles_per_s")
    emit(name + ".tiles_per_s", rate, "tiles/s", "idle, asked 0.7", rate / ratio(pairs, "tiles_per_s"))
    p99 = of_busy(pairs, "batch_ms_p99")
    emit(name + ".p99", p99, "ms", "idle, asked at most 3", p99 / ratio(pairs, "batch_ms_p99"))
    emit(name + ".acknowledged_p99", of_busy(pairs, "acknowledged_ms_p99"), "ms, keyframes meanwhile", "none", None)
    emit(name + ".workers_busy", of_busy(pairs, "workers_busy"), f"of {WORKERS} fusion workers", "none", None)
    emit(name + ".tiles_built", of_busy(pairs, "tiles_built"), "tiles meanwhile", "none", None)


def emit_age(emit, name, bin_dir, atlas, keyframes, per_s):
    """How long it takes until the map reflects what was acknowledged, while readers take all that they get."""
    with tempfile.TemporaryDirectory() as tiles:
        write_tile_files(bin_dir, atlas, tiles)
        row = busy_reads(bin_dir, atlas, tiles, ROUNDS, keyframes, per_s, round_ms=LONG_ROUND_MS, options=("age",))
    for what in ("p50", "max"):
        emit(f"{name}.map_age_{what}", row[f"map_age_s_{what}"], f"s, in {LONG_ROUND_MS // 1000} s of reads", "none", None)


def bench_uploads(bin_dir, emit, drive):
    """Keyframes on disk a second, from one connection and from four, against SQLite alone."""
    with tempfile.TemporaryDirectory() as folder:
        keyframes = stored_keyframes(bin_dir, drive, folder)
        for vehicles in (1, 4):
            raw_file = pathlib.Path(folder) / f"raw.{vehicles}.db"
            with Atlas(bin_dir, "--network-threads", str(THREADS), "--fusion", "false") as atlas:
                if os.stat(atlas.database).st_dev != os.stat(folder).st_dev:
                    raise RuntimeError("the two databases are not on the same file system")
                pairs = [alternate(number, lambda: raw_writes(bin_dir, keyframes, raw_file),
                                   lambda: uploads(bin_dir, atlas, keyframes, vehicles, number))
                         for number in range(-1, ROUNDS)][1:]  # the first one warms up
            for key, unit, scale in (("keyframes", "keyframes/s", 1), ("bytes", "MiB/s", 2**-20)):
                rate = scale * statistics.median(ours[key] / ours["seconds"] for _, ours in pairs)
                against = statistics.median((ours[key] / ours["seconds"]) / (raw[key] / raw["seconds"])
                                            for raw, ours in pairs)
                emit(f"uploads.{vehicles}_connections.{key}", rate, unit, "SQLite alone, asked 0.6", rate / against)


def raw_writes(bin_dir, keyframes, file):
    row, = rows_of(bin_dir / "upload_bench", "raw", keyframes, file, UPLOADS)
    return row


def uploads(bin_dir, atlas, keyframes, vehicles, number):
    _, row = rows_of(bin_dir / "upload_bench", "send", keyframes, atlas.port, f"round.{number}", vehicles,
                     UPLOADS // vehicles, 0)
    return row


def bench_connections(bin_dir, emit, drive):
    """A good client beside 2,000 quiet connections and 50 hostile ones: that break rules, in the clear and with TLS,
    that keep to them but ask for as much as may be asked, and that read nothing of what they ask for. Also
    how long a newcomer waits."""
    for name, with_tls, hostility, asked in (("connections", False, "breaks_rules", "asked at most 64"),
                                             ("connections_tls", True, "breaks_rules", "asked at most 160"),
                                             ("connections_heavy", False, "asks_much", "none"),
                                             ("connections_unread", False, "never_reads", "asked at most 64")):
        with contextlib.ExitStack() as stack:
            tiles, keys = (stack.enter_context(tempfile.TemporaryDirectory()) for _ in range(2))
            certificate = Certificate(keys) if with_tls else None
            atlas = stack.enter_context(Atlas(bin_dir, "--network-threads", str(THREADS), certificate=certificate))
            fill(atlas, drive)
            write_tile_files(bin_dir, atlas, tiles, certificate)
            load(bin_dir, atlas.port, tiles, "single", -1, tls=with_tls)  # what is kept ready counts as there
            before = atlas.resident_bytes()
            for connections in (1, CONNECTIONS):
                pairs = [crowd_round(bin_dir, atlas, tiles, number, connections, hostility, with_tls)
                         for number in range(-1, ROUNDS)][1:]  # the first one warms up
                emit_crowd(emit, f"{name}.{connections}", pairs, before, asked)
            if hostility == "breaks_rules":
                emit_newcomers(emit, name, atlas, crowd_of(bin_dir, atlas, hostility, with_tls))


def crowd_round(bin_dir, atlas, tiles, number, connections, hostility, with_tls):
    return alternate(number,
                     lambda: load(bin_dir, atlas.port, tiles, "single", number, connections=connections, tls=with_tls),
                     lambda: crowded(bin_dir, atlas, tiles, number, connections, hostility, with_tls))


def crowd_of(bin_dir, atlas, hostility, with_tls):
    return Beside(bin_dir / "crowd_bench", atlas.port, IDLE, SLOW, HOSTILE, hostility, *(["tls"] if with_tls else []))


def crowded(bin_dir, atlas, tiles, number, connections, hostility, with_tls):
    with crowd_of(bin_dir, atlas, hostility, with_tls) as crowd:
        time.sleep(0.5)
        row = load(bin_dir, atlas.port, tiles, "single", number, connections=connections, tls=with_tls)
        row["open"] = atlas.metric("roadatlas_connections")
        row["resident_bytes"] = atlas.resident_bytes()
        row.update(crowd.end())
    if row["open"] < IDLE + SLOW or row["refused"]:
        raise RuntimeError(f"the crowd was not let in: {row}")
    while atlas.metric("roadatlas_connections") > 0:
        time.sleep(0.05)
    return row


def emit_crowd(emit, name, pairs, before, asked):
    p99 = of_busy(pairs, "batch_ms_p99")
    emit(name + ".p99", p99, "ms", "without the crowd, asked at most 2", p99 / ratio(pairs, "batch_ms_p99"))
    rate = of_busy(pairs, "tiles_per_s")
    emit(name + ".tiles_per_s", rate, "tiles/s", "without the crowd", rate / ratio(pairs, "tiles_per_s"))
    emit(name + ".memory", (max(row["resident_bytes"] for _, row in pairs) - before) / 2**20,
         f"MiB more than {before >> 20}", asked, None)
    emit(name + ".visits", of_busy(pairs, "visits") / (ROUND_MS / 1000 + 0.5), "hostile connections/s", "none", None)


BENCHMARKS = {"reads": bench_reads, "uploads": bench_uploads, "connections": bench_connections}
