"""Whole drives tracked in a map by `atlas localize`: recorded ones, and second simulated ones (other direction, other
lane, other noise than the drive that the map is made of)."""

import csv
import math
import pathlib
import shutil
import subprocess
import tempfile

from bench_daemon import Atlas

IMAGES = pathlib.Path(__file__).parent.parent / "docs/images"
SAME_DECK_M = 1.0  # decks are 3 m apart and more

# name, what it says in a table, drive to map, drive to track, flags of either, goal of the RMSE
RUNS = [("kitti_0005", "`kitti_0005`, odd scans in the map of the even ones", "kitti_0005", "kitti_0005",
         ["--scans", "even", "--every", "0"], ["--scans", "odd"], None),
        ("overpass_B", "`sim_overpass_B` in the map of A", "sim_overpass_A", "sim_overpass_B", [], [], 0.05),
        ("garage", "simulated garage, second drive", "garage:0", "garage:1", [], [], 0.05),
        ("overpass", "simulated overpass, second drive", "overpass:0", "overpass:1", [], [], 0.05)]
COLUMNS = [("drive", "title"), ("scans", "scans"), ("restarts", "restarts"), ("RMSE m", "rmse_m"),
           ("RMSE deg", "rmse_deg"), ("along m", "along_m"), ("across m", "across_m"), ("up m", "up_m"),
           ("failed", "failures"), ("called good and failed", "wrongly_good"), ("on their deck", "on_deck"),
           ("NEES a freedom", "nees_per_freedom"), ("within 95 %", "within_95"), ("scans a CPU s", "hz")]


class Track:
    def __init__(self, name, title, goals, rows, summary):
        self.name, self.title, self.rows, self.summary = name, title, rows, summary
        self.goal_m, self.goal_on_deck = goals
        self.hits = [row for row in rows if not self.is_failure(row)]

    @staticmethod
    def is_failure(row):
        """As `atlas localize` counts."""
        return row["health"] == "lost" or not (float(row["error_m"]) <= 1.0 and float(row["error_deg"]) <= 5.0)

    def rmse(self, field):
        """None where no scan was located."""
        if not self.hits:
            return None
        return math.sqrt(sum(float(row[field]) ** 2 for row in self.hits) / len(self.hits))

    def rmse_text(self, field):
        return f"{self.rmse(field):.3f}" if self.hits else ""

    def on_deck(self):
        return sum(abs(float(row["up_m"])) < SAME_DECK_M and row["health"] != "lost" for row in self.rows)

    def nees(self):
        return [float(row["nees"]) for row in self.rows if row["nees"] and row["health"] != "lost"]

    def record(self):
        nees = self.nees()
        return {"title": self.title, "scans": len(self.rows), "restarts": self.summary["restarts"],
                **{key: self.rmse_text(field) for key, field in (
                    ("rmse_m", "error_m"), ("rmse_deg", "error_deg"), ("along_m", "along_m"),
                    ("across_m", "across_m"), ("up_m", "up_m"))},
                "failures": len(self.rows) - len(self.hits),
                "wrongly_good": sum(self.is_failure(row) and row["health"] == "good" for row in self.rows),
                "on_deck": f"{self.on_deck()} of {len(self.rows)}",
                "nees_per_freedom": f"{sum(nees) / len(nees) / 4:.2f}" if nees else "",
                "within_95": f"{sum(value <= 9.4877 for value in nees) / len(nees):.3f}" if nees else "",
                "hz": round(self.summary["hz"], 1)}


def folder_of(name, bin_dir, drive, work):
    """A recorded drive, or WORLD:SEED simulated."""
    if ":" not in name:
        return drive(name)
    world, seed = name.split(":")
    folder = pathlib.Path(work) / f"{world}_{seed}"
    subprocess.run([bin_dir / "atlas", "simulate", world, "-o", folder, "--seed", seed], check=True,
                   stdout=subprocess.DEVNULL)
    return folder


def track(bin_dir, drive, run):
    """By our method, and by the paper's."""
    name, title, mapped, tracked, map_flags, track_flags, goal_m = run
    with tempfile.TemporaryDirectory() as work, Atlas(bin_dir) as atlas:
        atlas.run("ingest", folder_of(mapped, bin_dir, drive, work), *map_flags)
        atlas.run("wait")
        folder = folder_of(tracked, bin_dir, drive, work)
        lines, picture = pathlib.Path(work) / "track.csv", pathlib.Path(work) / "track.png"

        def localize(name, title, goals, *flags):
            summary = atlas.run("localize", folder, *track_flags, "--output", lines, *flags)
            with open(lines, newline="", encoding="ascii") as file:
                return Track(name, title, goals, list(csv.DictReader(file)), summary)

        ours = localize(name, title, (goal_m, 1.0), "--plot", picture)
        shutil.copy(picture, IMAGES / f"track_{name}.png")
        paper = localize(f"{name}.paper", f"{title}, the paper's method", (None, None), "--mode", "paper")
        return [ours, paper]


def track_all(bin_dir, emit, drive):
    tracks = [found for run in RUNS for found in track(bin_dir, drive, run)]
    for found in tracks:
        name = f"tracking.{found.name}"
        if found.hits:
            emit(name + ".translation_rmse", found.rmse("error_m"), "m", "goal", found.goal_m)
            emit(name + ".rotation_rmse", found.rmse("error_deg"), "deg", "none", None)
        emit(name + ".failures", len(found.rows) - len(found.hits), f"of {len(found.rows)}", "none", None)
        emit(name + ".on_deck", found.on_deck() / len(found.rows), "of scans", "goal", found.goal_on_deck)
        emit(name + ".restarts", found.summary["restarts"], "jumps", "none", None)
        emit(name + ".rate", found.summary["hz"], "scans/CPU s", "none", None)
    return tracks


def bench_tracking(bin_dir, emit, drive):
    track_all(bin_dir, emit, drive)


BENCHMARKS = {"tracking": bench_tracking}
