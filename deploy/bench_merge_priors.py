"""Merging with positions from elsewhere: the four sessions of the simulated city, each keyframe with a position as a GNSS
of half a metre has it, its errors independent, or half of their variance staying for half a minute."""

import pathlib
import tempfile

from bench_daemon import Atlas
from bench_merge import CITY, Merge, city_drive, upload
from bench_merge_measures import overall, relative, rms

GNSS_M = 0.5  # along each axis
KINDS = {"independent": 0.0, "wandering": 0.5}  # the share of the variance that stays


def merge_with_positions(bin_dir, emit, drive, kind):
    with tempfile.TemporaryDirectory() as folder, Atlas(bin_dir) as atlas:
        work = pathlib.Path(folder)
        city = [city_drive(bin_dir, drive, work / f"city{i}", scans, i + 1, "--drift", str(i + 21), "--gnss",
                           f"{GNSS_M},{i + 51},{KINDS[kind]}") for i, scans in enumerate(CITY)]
        merge = Merge(bin_dir, atlas, [], work, kind)
        for i, session in enumerate(city):
            upload(atlas, [session], i, "--staged", "--positions", str(session / "positions.txt"))
        merge.folders = city
        merge.run("--dry-run")
        name = f"merge.positions.{kind}"
        emit(f"{name}.used", sum(session["positions"]["used"] for session in merge.report["sessions"]),
             f"of {len(city)} sessions", "asked", len(city))
        emit(f"{name}.overall", rms(overall(merge.visits)[0]), "m, after alignment", "asked", 0.2)
        emit(f"{name}.relative", rms(relative(merge.visits)[0]), "m", "asked", 0.05)


def bench_merge_priors(bin_dir, emit, drive):
    for kind in KINDS:
        merge_with_positions(bin_dir, emit, drive, kind)


BENCHMARKS = {"merge_priors": bench_merge_priors}
