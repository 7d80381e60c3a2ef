"""Merging: sessions of one simulated city, and of one garage, each with a drift of its own, uploaded staged, merged by
`atlas-merge run`, and compared with the true poses: four sessions of a city and three of a garage; with --long ten
kilometres, too, and then one more."""

import pathlib
import shutil
import subprocess
import tempfile

import bench_asked
from bench_daemon import Atlas
from bench_merge_measures import (Visit, closures_of, laid_into, localization_errors, overall, overlaps, pose_lines,
                                  relative, relative_to_last, rms, timed, visits_after, visits_before, wrong_closures)

IMAGES = pathlib.Path(__file__).parent.parent / "docs/images"
EVERY_M = 1.0
CITY = [(0, 760), (660, 1420), (1320, 2080), (1980, 2712)]  # scans of the trajectory, overlapping
LATER = (500, 1000)  # of a drive that comes when all is merged: over the first and the second session
# A garage: one session from deck to deck, two on a deck or two each.
GARAGE = [("0", 0, 216), ("2", 24, 66), ("4", 120, 162)]
LONG = [(197 * i, 197 * i + 740) for i in range(10)]  # 1 km each
ELEVENTH = (1100, 1840)
WRONG_SHARE, WRONG_SEEDS = 0.3, (1, 2, 3)


def simulate(bin_dir, world, folder, *flags):
    subprocess.run([bin_dir / "atlas", "simulate", world, "-o", folder, *flags], check=True, stdout=subprocess.DEVNULL)
    return folder


def city_drive(bin_dir, drive, folder, scans, seed, *flags):
    return simulate(bin_dir, "city", folder, "--trajectory", drive("kitti_trajectories") / "00.txt", "--every",
                    str(EVERY_M), "--range", f"{scans[0]}:{scans[1]}", "--seed", str(seed), *flags)


def with_poses(folder, poses, target):
    """The same drive with other poses."""
    target.mkdir()
    for entry in folder.iterdir():
        if entry.name != "poses.txt":
            (target / entry.name).symlink_to(entry)
    (target / "poses.txt").write_text(pose_lines(poses))
    return target


def upload(atlas, folders, first=0, *flags):
    for i, folder in enumerate(folders, first):
        atlas.run("ingest", folder, "--vehicle", f"car{i}", "--session", "day", *flags)


class Merge:
    """Sessions merged in a daemon, with what came of it."""

    def __init__(self, bin_dir, atlas, folders, work, name):
        self.bin, self.atlas, self.folders, self.work, self.name = bin_dir, atlas, folders, work, name
        self.submaps = work / f"{name}.work"
        upload(atlas, folders, 0, "--staged")

    def run(self, *flags):
        """Merges; keeps the report, what it cost, and the visits as they are then and were before."""
        corrections = self.work / f"{self.name}.txt"
        self.report, self.cost = timed([
            self.bin / "atlas-merge", "run", "--json", "--server", self.atlas.server, "--work", self.submaps,
            "--corrections", corrections, "--picture", self.work / f"{self.name}.png", *flags])
        self.visits = visits_after(self.folders, corrections)
        self.before = visits_before(self.folders, self.visits)

    def show(self, emit, asked):
        name = f"merge.{self.name}"
        closures = closures_of(self.report, self.visits)
        metres, turns = relative(self.visits)
        off_m, off_deg = overall(self.visits)
        seen, near = overlaps(self.visits, closures)
        emit(f"{name}.joined", sum(session["joined"] for session in self.report["sessions"]),
             f"of {len(self.visits)} sessions", "asked", len(self.visits))
        emit(f"{name}.before.relative", rms(relative(self.before)[0]), "m", "none", None)
        emit(f"{name}.before.overall", rms(overall(self.before)[0]), "m, after alignment", "none", None)
        emit(f"{name}.relative", rms(metres), f"m, {len(metres)} pairs within 5 m on one deck", "asked",
             asked["relative_m"])
        emit(f"{name}.relative_turn", rms(turns), "deg", "asked", 0.1)
        emit(f"{name}.overall", rms(off_m), "m, after alignment", "asked", 0.3)
        emit(f"{name}.overall_turn", rms(off_deg), "deg, after alignment", "asked", 0.2)
        emit(f"{name}.wrong", wrong_closures(self.visits, closures), f"of {len(closures)} closures", "asked", 0)
        emit(f"{name}.overlaps", seen / max(1, near), f"of {near} keyframes near another session", "asked", 0.9)
        self.show_cost(emit, name, 600)

    def show_cost(self, emit, name, asked_s):
        emit(f"{name}.seconds", self.cost["seconds"], "s", "asked", asked_s)
        emit(f"{name}.cpu", self.cost["cpu_s"], "s of CPU", "none", None)
        emit(f"{name}.memory", self.cost["memory_mb"], "MB", "asked", 2000)

    def check_tiles(self, emit):
        """The atlas is what these poses make of it, and no other tile was fused again."""
        self.atlas.run("wait", "--timeout", "3000")
        verified = self.atlas.run("verify", "--rebuild", "--timeout", "3000")  # it fails where a tile differs
        emit(f"merge.{self.name}.rebuilt_damaged", verified["damaged"], "tiles that differ from a build", "asked", 0)
        emit(f"merge.{self.name}.tiles", self.report["tiles_marked"], "marked by the daemon",
             "under the footprints of what moved", self.report["tiles"])


def show_wrong_ones(emit, merge, bin_dir):
    """Before anything is applied: wrong closures beside those that are found."""
    clean = rms(overall(merge.visits)[0])
    for seed in WRONG_SEEDS:
        corrections = merge.work / f"wrong{seed}.txt"
        row, _ = timed([bin_dir / "merge_bench", merge.atlas.database, merge.submaps, WRONG_SHARE, seed, corrections])
        visits = visits_after(merge.folders, corrections)
        emit(f"merge.wrong.{seed}.overall", rms(overall(visits)[0]), f"m with {row['put']} wrong ones",
             "without them", clean)
        emit(f"merge.wrong.{seed}.relative", rms(relative(visits)[0]), "m", "without them",
             rms(relative(merge.visits)[0]))
        emit(f"merge.wrong.{seed}.believed", row["wrong"], f"wrong of {row['believed']}", "asked", 0)


def localize(atlas, folder, work):
    rows = work / "later.csv"
    atlas.run("localize", folder, "--output", rows)
    return localization_errors(rows)


def show_localization(emit, bin_dir, merge, later):
    """A later drive in the merged map, by where that map has it, and in a map of true poses."""
    truth = Visit(later).truth
    in_map = with_poses(later, laid_into(merge.visits, truth), merge.work / "later_in_map")
    metres, turn, lost = localize(merge.atlas, in_map, merge.work)
    with Atlas(bin_dir) as other:
        for i, visit in enumerate(merge.visits):
            upload(other, [with_poses(merge.folders[i], visit.truth, merge.work / f"true{i}")], i)
        other.run("wait", "--timeout", "3000")
        true_metres, true_turn, true_lost = localize(other, with_poses(later, truth, merge.work / "later_truth"),
                                                     merge.work)
    emit("merge.localization", metres, f"m in the merged map, {len(truth)} scans", "in a map of true poses", true_metres)
    emit("merge.localization_turn", turn, "deg", "in a map of true poses", true_turn)
    emit("merge.localization_lost", lost, "scans", f"{true_lost} in a map of true poses", None)


def layers_at(atlas, poses):
    return [len(atlas.run("point", f"{pose[0, 3]:.3f}", f"{pose[1, 3]:.3f}")["layers"]) for pose in poses]


def show_layers(emit, bin_dir, merge):
    """Surfaces above each other at every fourth keyframe: in the merged map, and in one of true poses."""
    with Atlas(bin_dir) as other:
        for i, visit in enumerate(merge.visits):
            upload(other, [with_poses(merge.folders[i], visit.truth, merge.work / f"deck{i}")], i)
        other.run("wait", "--timeout", "3000")
        is_so = [count for visit in merge.visits for count in layers_at(merge.atlas, visit.poses[visit.stored[::4]])]
        should = [count for visit in merge.visits for count in layers_at(other, visit.truth[visit.stored[::4]])]
    same = sum(a == b for a, b in zip(is_so, should))
    emit("merge.garage.layers", same / len(should), f"of {len(should)} places with as many surfaces, up to {max(should)}",
         "in a map of true poses", 1.0)
    emit("merge.garage.most_layers", max(is_so), "surfaces above each other", "in a map of true poses", max(should))


def merge_city(bin_dir, emit, drive):
    with tempfile.TemporaryDirectory() as folder, Atlas(bin_dir) as atlas:
        work = pathlib.Path(folder)
        city = [city_drive(bin_dir, drive, work / f"city{i}", scans, i + 1, "--drift", str(i + 21))
                for i, scans in enumerate(CITY)]
        merge = Merge(bin_dir, atlas, city, work, "city")
        merge.run("--dry-run")
        merge.show(emit, {"relative_m": 0.05})
        shutil.copy(work / "city.png", IMAGES / "merge.png")
        show_wrong_ones(emit, merge, bin_dir)
        merge.run()
        merge.show_cost(emit, "merge.city.again", 60)
        merge.check_tiles(emit)
        later = city_drive(bin_dir, drive, work / "later", LATER, 9, "--drift", "9")
        show_localization(emit, bin_dir, merge, later)


def merge_garage(bin_dir, emit):
    with tempfile.TemporaryDirectory() as folder, Atlas(bin_dir) as atlas:
        work = pathlib.Path(folder)
        garage = [simulate(bin_dir, "garage", work / f"garage{i}", "--seed", seed, "--range", f"{begin}:{end}",
                           "--drift", str(i + 31)) for i, (seed, begin, end) in enumerate(GARAGE)]
        merge = Merge(bin_dir, atlas, garage, work, "garage")
        merge.run()
        merge.show(emit, {"relative_m": 0.08})
        merge.check_tiles(emit)
        show_layers(emit, bin_dir, merge)


def merge_long(bin_dir, emit, drive):
    with tempfile.TemporaryDirectory() as folder, Atlas(bin_dir) as atlas:
        work = pathlib.Path(folder)
        ten = [city_drive(bin_dir, drive, work / f"long{i}", scans, i + 41, "--drift", str(i + 61))
               for i, scans in enumerate(LONG)]
        merge = Merge(bin_dir, atlas, ten, work, "long")
        merge.run()
        merge.show(emit, {"relative_m": 0.05})
        merge.check_tiles(emit)
        first = merge.visits
        eleventh = city_drive(bin_dir, drive, work / "long10", ELEVENTH, 51, "--drift", "71")
        upload(atlas, [eleventh], len(ten), "--staged")
        merge.folders.append(eleventh)
        merge.run()
        joined = merge.report["sessions"][-1]
        emit("merge.eleventh.joined", int(joined["joined"]), "of 1 session", "asked", 1)
        emit("merge.eleventh.moved", sum(session["moved"] > 0 for session in merge.report["sessions"][:-1]),
             "other sessions moved", "none", None)
        metres, turns = relative_to_last(first + merge.visits[-1:])
        emit("merge.eleventh.relative", rms(metres), f"m, {len(metres)} pairs within 5 m", "asked", 0.05)
        emit("merge.eleventh.relative_turn", rms(turns), "deg", "asked", 0.1)
        merge.show_cost(emit, "merge.eleventh", 60)
        merge.check_tiles(emit)


def bench_merge(bin_dir, emit, drive):
    merge_city(bin_dir, emit, drive)
    merge_garage(bin_dir, emit)
    if bench_asked.LONG:
        merge_long(bin_dir, emit, drive)


BENCHMARKS = {"merge": bench_merge}
