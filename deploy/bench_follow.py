"""The benchmark of deploy/bench.sh on what travels to a vehicle: along a drive, with and without a map of before,
the first map over a slow link, and what changed since. Docs/results.md, "Serving"."""

import pathlib
import statistics
import subprocess
import tempfile

from bench_daemon import Atlas, rows_of

EVERY_M = 1  # between keyframes
# What another vehicle uploads that drives the same way: its scans.
UPDATES = {"one_keyframe": "1000:1001", "20_m": "1500:1520", "200_m": "2000:2200"}
PLACES = 8  # of the drive, for the first map
IMAGE = pathlib.Path(__file__).parent.parent / "docs/images/follow.png"


def wire_bytes(row):
    return row.get("sent", 0) + row["received"]


def total(rows):
    return sum(wire_bytes(row) for row in rows)


def emit_totals(runs, emit):
    for name, asked in (("cold", 0.1), ("warm", 0.01)):
        emit(f"follow.{name}.bytes", total(runs[name]), f"bytes both ways, {len(runs[name])} requests",
             f"all finest tiles each time, asked {asked}", total(runs["discs"]))
        emit(f"follow.{name}.sent", sum(row["sent"] for row in runs[name]), "bytes of requests", "all",
             total(runs[name]))
        emit(f"follow.{name}.tiles", sum(row["tiles"] for row in runs[name]), "tiles", "all finest tiles each time",
             sum(row["tiles"] for row in runs["discs"]))
    emit("follow.discs.bytes", total(runs["discs"]), "bytes", "none", None)
    emit("follow.discs.tiles", sum(row["tiles"] for row in runs["discs"]), "tiles", "none", None)


def emit_first(firsts, near, emit):
    def emit_times(name, times, against, asked):
        times = [time_s if time_s >= 0 else float("inf") for time_s in times]
        emit(f"{name}.median", statistics.median(times), "s", against, asked)
        emit(f"{name}.most", max(times), "s", against, asked)

    emit_times("first_map.covered", [first["covered_s"] for first in firsts], "asked at most 2", 2)
    emit("first_map.covered.bytes", max(first["covered_bytes"] for first in firsts), "bytes down, most", "none", None)
    emit_times("first_map.planned", [first["planned_s"] for first in firsts], "none", None)
    emit_times("first_map.near.planned", [first["planned_s"] for first in near], "none", None)
    for what, choose in (("least", min), ("most", max)):
        emit(f"first_map.near.bytes.{what}", choose(sum(first["blob_bytes"]) for first in near), "bytes of tiles",
             "none", None)
    for level in reversed(range(len(firsts[0]["complete_s"]))):
        emit_times(f"first_map.level_{level}", [first["complete_s"][level] for first in firsts], "none", None)
        for what, choose in (("least", min), ("most", max)):
            emit(f"first_map.level_{level}.tiles.{what}", choose(first["tiles"][level] for first in firsts), "tiles",
                 "none", None)


def emit_update(name, keyframes, row, emit):
    emit(f"follow.{name}.bytes", row["bytes"], f"bytes for {keyframes} keyframes, {row['deltas']} of {row['tiles']} tiles "
         "as differences", "the same tiles whole", row["whole_bytes"])


def draw(runs, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axis = pyplot.subplots(figsize=(8, 4.2))
    for name, label, color in (("discs", "all finest tiles within 150 m, each time", "tab:red"),
                               ("cold", "sync, without a map", "tab:blue"),
                               ("warm", "sync, with the map of the drive before", "tab:green")):
        sums, at = [], 0
        for row in runs[name]:
            at += wire_bytes(row)
            sums.append(at)
        axis.plot([row["at_m"] / 1000 for row in runs[name]], sums, color=color, label=label)
        axis.annotate(f"{at / 1e6:.3g} MB", (runs[name][-1]["at_m"] / 1000, at), xytext=(-4, 5),
                      textcoords="offset points", ha="right", fontsize=8, color=color)
    axis.set_yscale("log")
    axis.set_ylim(top=3e9)
    axis.set_xlabel("driven, km (a request every 20 m, 1.2 s at 60 km/h)")
    axis.set_ylabel("bytes both ways, in all")
    axis.grid(alpha=0.3, which="major")
    axis.legend(fontsize=8, loc="center right", bbox_to_anchor=(1.0, 0.56))
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def simulate(bin_dir, trajectory, folder, seed=0):
    subprocess.run([bin_dir / "atlas", "simulate", "city", "--trajectory", trajectory, "--every", str(EVERY_M),
                    "--seed", str(seed), "-o", folder], check=True, stdout=subprocess.DEVNULL)
    return folder


def bench_follow(bin_dir, emit, drive):
    """A simulated city along KITTI's odometry drive 00, 3.7 km; draws docs/images/follow.png."""
    trajectory = drive("kitti_trajectories") / "00.txt"
    with tempfile.TemporaryDirectory() as work, Atlas(bin_dir) as atlas:
        city = simulate(bin_dir, trajectory, pathlib.Path(work) / "city")
        emit("follow.metres", atlas.run("ingest", city)["metres"], "m", "asked", 3700)
        atlas.run("wait")
        bench, poses = bin_dir / "follow_bench", city / "poses.txt"
        held = pathlib.Path(work) / "held"
        runs = {name: list(rows_of(bench, "drive", atlas.server, poses, held)) for name in ("cold", "warm")}
        runs["discs"] = list(rows_of(bench, "discs", atlas.server, poses))
        emit_totals(runs, emit)
        draw(runs, IMAGE)
        emit_first(*(list(rows_of(bench, name, atlas.server, poses, PLACES)) for name in ("first", "near")), emit)
        again = simulate(bin_dir, trajectory, pathlib.Path(work) / "again", seed=2)
        for name, scans in UPDATES.items():
            keyframes = atlas.run("ingest", again, "--range", scans, "--session", name)["keyframes"]
            atlas.run("wait")
            row, = rows_of(bench, "update", atlas.server, poses, held)
            emit_update(name, keyframes, row, emit)


BENCHMARKS = {"follow": bench_follow}
