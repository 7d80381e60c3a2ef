"""The benchmark of deploy/bench.sh on a daemon that does everything at once for a long time: whether memory, its log,
descriptors or threads grow. Docs/results.md, "Long runs"."""

import contextlib
import csv
import math
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import bench_asked
import bench_soak_plot
from bench_daemon import Atlas, Background
from bench_soak_load import Street, actors_of
from bench_traffic import Failures, record_street

MINUTES, MINUTES_LONG = 3, 90  # of which the last two thirds count; 30 minutes cannot tell 4 MiB from what swings
GROWTH_S = 20 * 60  # growth is told for so long, or for what counts if that is shorter
PARTS = 20
# Caches so small that they are full before the last two thirds begin: what grows then is no cache.
SETTINGS = ("--cache-mib", "32", "--survey-mib", "32", "--reply-mib", "8", "--survey-disk-mib", "64")
ASKED_SAMPLES = 0.9  # of the seconds; with less the machine had no time for the load either
ASKED_GROWTH_MIB = 4
ASKED_LOG_MIB = 64
ASKED_MORE = 8  # descriptors and threads: the store opens its readers' connections as they are needed at once
FIELDS = ("second", "resident_mib", "log_mib", "descriptors", "threads", "used_mib", "dirty_tiles")
ROOT = pathlib.Path(__file__).parent.parent
SAMPLES = ROOT / "build/bench/soak.csv"


class Sampler(Background):
    """A row a second, less where the machine is too busy for that, each written to SAMPLES at once."""

    def __init__(self, atlas, failures):
        super().__init__("sampler")
        self.atlas, self.failures, self.rows = atlas, failures, []

    def run(self):
        began = time.monotonic()
        with open(SAMPLES, "w", newline="", encoding="ascii", buffering=1) as file:
            table = csv.DictWriter(file, FIELDS)
            table.writeheader()
            while not self.is_over.wait(1 - (time.monotonic() - began) % 1):
                with self.failures.noted("sampler"):
                    self.rows.append(self.sample(time.monotonic() - began))
                    table.writerow(self.rows[-1])

    def sample(self, second):
        process = pathlib.Path(f"/proc/{self.atlas.process.pid}")
        log = self.atlas.database.with_name("atlas.db-wal")
        return dict(zip(FIELDS, (
            round(second, 2), self.atlas.resident_bytes() / 2**20, log.stat().st_size / 2**20,
            len(list((process / "fd").iterdir())), len(list((process / "task").iterdir())),
            self.atlas.metric("roadatlas_store_used_bytes") / 2**20, self.atlas.metric("roadatlas_dirty_tiles"))))


def growth(rows, field, of=statistics.fmean):
    """In GROWTH_S, by the straight line through `of` each of the PARTS of what counts: (growth, its standard error).
    Samples one behind the other say less than their number: the error is made of the parts."""
    seconds = [row["second"] for row in rows]
    span = seconds[-1] - seconds[0]
    parts = [(statistics.fmean(row["second"] for row in part), of([row[field] for row in part]))
             for part in (rows[len(rows) * n // PARTS:len(rows) * (n + 1) // PARTS] for n in range(PARTS))]
    at, values = zip(*parts)
    line = statistics.linear_regression(at, values)
    left = sum((value - line.intercept - line.slope * second) ** 2 for second, value in parts) / (PARTS - 2)
    error = math.sqrt(left / (statistics.variance(at) * (PARTS - 1)))
    return line.slope * min(GROWTH_S, span), error * min(GROWTH_S, span)


def bench_soak(bin_dir, emit, drive):
    """Vehicles, corrections, retractions, purges, reads, watches, scrapes and backups at once; draws
    docs/images/soak.png with --long. Exits with 1 if a figure is not what was asked."""
    minutes = MINUTES_LONG if bench_asked.LONG else MINUTES
    failures = Failures()
    with tempfile.TemporaryDirectory() as backups:
        street = Street(record_street(bin_dir), backups)
        with Atlas(bin_dir, *SETTINGS, "--backup-folder", backups) as atlas:
            street.fill(atlas)
            rows, acts = run(atlas, street, failures, 60 * minutes)
            refused = atlas.refused_requests()
            verified = atlas.run("verify")
    bench_soak_plot.draw(rows, minutes, ROOT / ("docs/images/soak.png" if bench_asked.LONG else "build/bench/soak.png"))
    for name, number in acts.items():
        emit(f"soak.{name}", number, f"times in {minutes} min", "none", None)
    emit("soak.not_now", failures.not_now, "requests that were told to come again", "none", None)
    judge(emit, minutes, [row for row in rows if row["second"] >= 20 * minutes], failures, refused, verified)


def run(atlas, street, failures, seconds):
    """The samples, and how often each actor acted."""
    with contextlib.ExitStack() as stack:
        actors = [stack.enter_context(actor) for actor in actors_of(atlas, street, failures)]
        with Sampler(atlas, failures) as sampler, contextlib.suppress(subprocess.TimeoutExpired):
            raise RuntimeError(f"the daemon ended with {atlas.process.wait(seconds)}")
    return sampler.rows, {actor.name: actor.acts for actor in actors}


def judge(emit, minutes, rows, failures, refused, verified):
    """`rows` are those of the last two thirds."""
    span = f"the last {2 * minutes / 3:g} min"
    within = f"{min(GROWTH_S / 60, 2 * minutes / 3):g} min"
    for what in (*failures.others[:20], *(f"{kind}: {count}" for kind, count in refused.items())):
        print(f"soak: {what}", file=sys.stderr)
    emit("soak.memory", max(row["resident_mib"] for row in rows), f"MiB, most in {span}", "none", None)
    with bench_asked.Asked(emit) as asked:
        asked.at_least("soak.samples", len(rows), f"in {span}", ASKED_SAMPLES * 40 * minutes)
        grown, error = growth(rows, "resident_mib")
        asked.at_most("soak.memory_growth", grown, f"MiB in {within}, by a straight line", ASKED_GROWTH_MIB)
        emit("soak.memory_growth.error", error, "MiB, the line's standard error", "none", None)
        grown, error = growth(rows, "resident_mib", min)
        emit("soak.memory_growth.least", grown, f"MiB in {within}, of the least values", "none", None)
        emit("soak.memory_growth.least.error", error, "MiB, the line's standard error", "none", None)
        asked.at_most("soak.log", max(row["log_mib"] for row in rows), f"MiB, largest in {span}", ASKED_LOG_MIB)
        for what in ("descriptors", "threads"):
            asked.at_most(f"soak.{what}_growth", growth(rows, what)[0], f"in {within}", ASKED_MORE)
        asked.at_most("soak.failures", len(failures.others), "seen by those who asked", 0)
        asked.at_most("soak.refused", sum(refused.values()), "counted by the daemon", 0)
        asked.at_most("soak.damaged", verified["damaged"] + verified["mismatched"],
                      f"of {verified['checked']} read back", 0)


BENCHMARKS = {"soak": bench_soak}
