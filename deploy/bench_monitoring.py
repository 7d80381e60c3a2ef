"""Map monitoring: drives tracked in maps that were damaged on purpose, the contradictions reported against the changes
made; and a street whose parked cars are others than on the day it was mapped, against the labels of both days."""

import csv
import pathlib
import subprocess
import tempfile

from bench_daemon import Atlas, rows_of

IMAGES = pathlib.Path(__file__).parent.parent / "docs/images"
RINGS = 16
ASKED = 0.8
# name, drive of the map, its scans, tracked drive, its scans; WORLD:SEED is simulated
RUNS = [("kitti_0005", "kitti_0005", "even", "kitti_0005", "odd"),
        ("overpass", "overpass:0", "all", "overpass:1", "all"),
        ("garage", "garage:0", "all", "garage:1", "all"),
        ("street", "street:0", "all", "street:1", "all")]
DAMAGES = ["none", "columns", "cars", "building", "all"]
CELL_M, RANGE_M = 0.1, (2.0, 30.0)
CAR = 10                    # of the labels: parked
BUMPER_M = 0.4              # above the road; lower returns may be of its sides or of the road
PLACE_REACH_CELLS = 3       # a car's own cells in the other visit


def simulate(bin_dir, folder, world, *flags):
    subprocess.run([bin_dir / "atlas", "simulate", world, "-o", folder, *flags], check=True, stdout=subprocess.DEVNULL)
    return folder


def folder_of(name, bin_dir, drive, work):
    if ":" not in name:
        return drive(name)
    world, seed = name.split(":")
    folder = pathlib.Path(work) / f"{world}_{seed}"
    return folder if folder.is_dir() else simulate(bin_dir, folder, world, "--seed", seed)


def share(pairs):
    pairs = list(pairs)
    return sum(pair[0] for pair in pairs) / max(1, sum(pair[1] for pair in pairs))


def report_damage(name, damage, by_scans, emit):
    """`by_scans`: rows of one run, of changes that were seen in so many scans at least."""
    row, title = by_scans[1], f"monitoring.{name}.{damage}"
    emit(title + ".lost", row["lost"], f"of {row['scans']} scans", "goal", 0.0)
    emit(title + ".translation_rmse", row["rmse_m"], "m", "none", None)
    emit(title + ".cpu", row["monitor_ms"], "ms a scan", "localization", row["ms_per_scan"] - row["monitor_ms"])
    if damage == "none":
        for kind in ("appeared", "vanished", "moving"):
            emit(f"{title}.{kind}", row[kind][1], "cells", "none", None)
        return
    for kind in ("appeared", "vanished"):
        emit(f"{title}.{kind}.precision", share([row[kind]]), f"of {row[kind][1]} cells", "asked", ASKED)
        for scans, seen in by_scans.items():
            found = [pair for key, pair in seen["found"].items() if key.startswith(kind)]
            emit(f"{title}.{kind}.recall_{scans}", share(found),
                 f"of {sum(pair[1] for pair in found)} cells seen in {scans} scans", "asked", ASKED)
    emit(title + ".precision", share(row[kind] for kind in ("appeared", "vanished")), "of what lasts", "asked", ASKED)
    emit(title + ".recall", share(row["found"].values()), "of all that was seen", "asked", ASKED)


def bench_damage(bin_dir, emit, drive, work):
    for name, mapped, map_scans, tracked, track_scans in RUNS:
        rows = rows_of(bin_dir / "monitoring_bench", folder_of(mapped, bin_dir, drive, work), map_scans,
                       folder_of(tracked, bin_dir, drive, work), track_scans, RINGS, *DAMAGES)
        by_damage = {}
        for row in rows:
            by_damage.setdefault(row["damage"], {})[row["min_scans"]] = row
        for damage, by_scans in by_damage.items():
            report_damage(name, damage, by_scans, emit)


def car_cells(folder):
    """Cells that returns of parked cars fell into, and in how many scans."""
    import numpy
    poses = numpy.loadtxt(folder / "poses.txt").reshape(-1, 3, 4)
    scans = {}
    for file in sorted((folder / "velodyne").iterdir()):
        points = numpy.fromfile(file, numpy.float32).reshape(-1, 4)[:, :3]
        labels = numpy.fromfile(folder / "labels" / (file.stem + ".label"), numpy.uint32) & 0xFFFF
        away = numpy.hypot(points[:, 0], points[:, 1])
        pose = poses[int(file.stem)]
        world = points @ pose[:, :3].T + pose[:, 3]
        is_car = (labels == CAR) & (away > RANGE_M[0]) & (away < RANGE_M[1]) & (world[:, 2] > BUMPER_M)
        for cell in {tuple(cell) for cell in numpy.floor(world[is_car, :2] / CELL_M).astype(int)}:
            scans[cell] = scans.get(cell, 0) + 1
    return scans


def is_near(cell, cells, reach):
    return any((cell[0] + i, cell[1] + j) in cells for i in range(-reach, reach + 1) for j in range(-reach, reach + 1))


def bench_parked(bin_dir, emit, work):
    """Cars of the second day where none stood on the first appeared; those of the first day alone vanished. Draws
    docs/images/contradictions.png."""
    days = [simulate(bin_dir, pathlib.Path(work) / f"day{day}", "street", "--parked", str(day), "--seed", str(day))
            for day in (1, 2)]
    cars = [car_cells(day) for day in days]
    file = pathlib.Path(work) / "contradictions.csv"
    with Atlas(bin_dir) as atlas:
        atlas.run("ingest", days[0], "--max-range", "40", "--every", "0")
        atlas.run("wait")
        atlas.run("localize", days[1], "--contradictions", file)
        atlas.run("render", "-o", IMAGES / "contradictions.png", "--contradictions", file)
    with open(file, newline="", encoding="ascii") as lines:
        rows = list(csv.DictReader(lines))
    for kind, here, elsewhere in (("appeared", cars[1], cars[0]), ("vanished", cars[0], cars[1])):
        found = {(int(float(row["x_m"]) // CELL_M), int(float(row["y_m"]) // CELL_M)) for row in rows
                 if row["kind"] == kind}
        changed = {cell: scans for cell, scans in here.items() if not is_near(cell, elsewhere, PLACE_REACH_CELLS)}
        right = sum(is_near(cell, changed, 1) for cell in found)
        emit(f"monitoring.parked.{kind}.precision", right / max(1, len(found)), f"of {len(found)} cells", "asked", ASKED)
        for scans in (1, 6):
            seen = [cell for cell, count in changed.items() if count >= scans]
            emit(f"monitoring.parked.{kind}.recall_{scans}", sum(is_near(cell, found, 1) for cell in seen) / max(1, len(seen)),
                 f"of {len(seen)} cells in {scans} scans", "asked", ASKED)


def bench_monitoring(bin_dir, emit, drive):
    with tempfile.TemporaryDirectory() as work:
        bench_damage(bin_dir, emit, drive, work)
        bench_parked(bin_dir, emit, work)


BENCHMARKS = {"monitoring": bench_monitoring}
