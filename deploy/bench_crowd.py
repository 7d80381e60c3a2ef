"""The benchmark of deploy/bench.sh on who waits beside a reader's many connections that ask for what takes longest to
plan, and beside digests of the past, in an atlas of 12,500 tiles. Docs/results.md, "Serving"."""

import hashlib
import pathlib
import statistics
import subprocess
import tempfile
import time

from bench_daemon import Atlas, rows_of
from bench_load import Beside, alternate, of_busy, ratio

SIDE = 97  # tiles of the finest level along each side: 12,545 of all levels
ROUNDS = 3
SECONDS = 2
FED_BYTES = 1 << 20  # that have gone to the crowd when it is at work
PATIENCE_S = 60  # until then
QUESTIONS = (("status", 16), ("uploads", 60))  # and beside how many connections
DIGESTS = 2
SENT = "roadatlas_sent_bytes_total"


def bench_crowd(bin_dir, emit, drive):
    """Status and uploads with a crowd of corridors and without, in turns; a query of the past beside two digests of it.
    Nothing is fused meanwhile."""
    with tempfile.TemporaryDirectory() as folder, Atlas(bin_dir, "--anonymous", "admin") as atlas:
        subprocess.run([bin_dir / "wide_atlas", atlas.port, str(SIDE)], check=True)
        atlas.run("wait")
        atlas.stop()
        atlas.start("--fusion", "false", "--anonymous", "admin", "--tokens", token_file(folder, "reader", "admin"))
        emit("crowd.tiles", atlas.metric("roadatlas_tiles"), "tiles of all levels", "none", None)
        for what, peers in QUESTIONS:
            emit_answers(emit, f"crowd.{what}", peers, [answers_round(bin_dir, atlas, what, peers, number)
                                                        for number in range(-1, ROUNDS)][1:])  # the first one warms up
        emit_past(emit, bin_dir, atlas)


def token_file(folder, *roles):
    """Each role has a token of its name, which somebody of that name holds."""
    file = pathlib.Path(folder) / "tokens"
    file.write_text("".join(f"{role} {role} never {hashlib.sha256(role.encode()).hexdigest()}\n" for role in roles),
                    encoding="ascii")
    return str(file)


def answers_round(bin_dir, atlas, what, peers, number):
    return alternate(number, lambda: answers(bin_dir, atlas, what, f"alone.{number}"),
                     lambda: crowded(bin_dir, atlas, what, peers, number))


def answers(bin_dir, atlas, what, session):
    row, = rows_of(bin_dir / "answer_bench", atlas.port, what, SECONDS, *([session] if what == "uploads" else []))
    return row


def crowded(bin_dir, atlas, what, peers, number):
    with Beside(bin_dir / "crowd_bench", atlas.port, 0, 0, peers, "asks_wide", "token", "reader") as crowd:
        wait_until_fed(atlas, peers)
        began, before = time.monotonic(), atlas.metric(SENT)
        row = answers(bin_dir, atlas, what, f"crowd.{number}")
        row["mib_per_s"] = (atlas.metric(SENT) - before) / 2**20 / (time.monotonic() - began)
        row.update(crowd.end())
    if row["refused"] or row["visits"] > peers:  # who is refused comes again
        raise RuntimeError(f"the crowd was not let in: {row}")
    while atlas.metric("roadatlas_connections") > 0:
        time.sleep(0.05)
    return row


def wait_until_fed(atlas, peers):
    until, before = time.monotonic() + PATIENCE_S, atlas.metric(SENT)
    while atlas.metric("roadatlas_connections") < peers or atlas.metric(SENT) < before + FED_BYTES:
        if time.monotonic() > until:
            raise RuntimeError("the crowd gets nothing")
        time.sleep(0.05)


def emit_answers(emit, name, peers, pairs):
    for key in ("ms_p50", "ms_p99", "ms_max"):
        alone = statistics.median(idle[key] for idle, _ in pairs)
        busy = of_busy(pairs, key)
        emit(f"{name}.alone.{key}", alone, "ms", "none", None)
        emit(f"{name}.{peers}_corridors.{key}", busy, "ms", "without the crowd", busy / ratio(pairs, key))
    emit(f"{name}.{peers}_corridors.mib_per_s", of_busy(pairs, "mib_per_s"), "MiB/s to the crowd", "none", None)


def emit_past(emit, bin_dir, atlas):
    for digests in (0, DIGESTS):
        row, = rows_of(bin_dir / "answer_bench", atlas.port, "past", SIDE, "admin", "reader", digests)
        name = f"crowd.past.{digests}_digests"
        emit(f"{name}.in_time", row["in_time"], f"of {row['asked']} queries with 2 s", "all", row["asked"])
        emit(f"{name}.ms_max", row["ms_max"], "ms until the answer", "their 2 s", 2000)


BENCHMARKS = {"crowd": bench_crowd}
