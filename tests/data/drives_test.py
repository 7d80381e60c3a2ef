#!/usr/bin/python3
"""The main path on recorded drives, through the command line only. Usage: drives_test.py BIN_DIR TEST.

Each TEST prints its figures; exit 77 with a reason where its drives are not in $ATLAS_DATA.
"""

import csv
import json
import math
import os
import pathlib
import random
import shutil
import signal
import struct
import subprocess
import sys
import tempfile

SKIPPED = 77


class Atlas:
    """A daemon on a free port with its data in a folder, and the command line speaking to it."""

    def __init__(self, bin_dir, folder, *flags):
        self.bin = bin_dir
        self.flags = flags
        self.folder = folder
        self.start()

    def start(self):
        self.process = subprocess.Popen(
            [self.bin / "atlasd", "--data", self.folder + "/atlas", "--listen", "127.0.0.1:0",
             "--log-level", "error", *self.flags], stdout=subprocess.PIPE, text=True)
        self.server = self.process.stdout.readline().split()[1]

    def stop(self, how=signal.SIGTERM):
        self.process.send_signal(how)
        return self.process.wait(timeout=60)

    def call(self, *args):
        return subprocess.run([self.bin / "atlas", *map(str, args), "--server", self.server, "--json"],
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)

    def run(self, *args):
        done = self.call(*args)
        assert done.returncode == 0, f"{args}: exit {done.returncode}: {done.stderr}"
        return json.loads(done.stdout.strip().splitlines()[-1])


def drive(name):
    data = os.environ.get("ATLAS_DATA")
    if not data or not (pathlib.Path(data) / name).is_dir():
        print(f"skipped: {name} is not in $ATLAS_DATA (docs/data.md)")
        sys.exit(SKIPPED)
    return pathlib.Path(data) / name


def positions(folder):
    rows = [list(map(float, line.split())) for line in (folder / "poses.txt").read_text().splitlines()]
    return [(row[3], row[7], row[11]) for row in rows]


def overpass(atlas):
    atlas.run("ingest", drive("sim_overpass_A"))
    atlas.run("wait")
    heights = [layer["z_m"] for layer in atlas.run("point", 0, -3)["layers"]]
    print("layers at (0, -3):", heights)
    assert len(heights) == 2
    assert abs(heights[0] - 0.0) <= 0.03 and abs(heights[1] - 5.49) <= 0.03
    # The other direction, the other lane. On the bare plain of the first 17 scans nothing tells how fast
    # the vehicle is; once structure is in view it is found, and nowhere it is said to be that it is not.
    lines = atlas.call("localize", drive("sim_overpass_B")).stdout.splitlines()
    scans = [json.loads(line) for line in lines[:-1]]
    ground = [scan["error_m"] for scan in scans if scan["scan"] <= 120]
    held = sum(error <= 1.0 for error in ground)
    print(f"tracked below the bridge: {held} of {len(ground)} scans within 1 m; summary {lines[-1]}")
    assert len(ground) == 121 and held >= 95
    assert all(scan["error_m"] <= 1.0 for scan in scans[:121] if scan["health"] == "good")


def garage(atlas):
    folder = drive("sim_garage_A")
    atlas.run("ingest", folder)
    atlas.run("wait")
    poses = positions(folder)
    found = sum(any(abs(layer["z_m"] - (z - 1.8)) <= 0.10 for layer in atlas.run("point", x, y)["layers"])
                for x, y, z in poses)
    print(f"floor found at {found} of {len(poses)} poses")
    assert found >= 0.95 * len(poses)
    ends = ["--from", ",".join(map(str, poses[0])), "--to", ",".join(map(str, poses[-1]))]
    route = atlas.run("plan", *ends)
    steps = [abs(b[2] - a[2]) for a, b in zip(route["waypoints"], route["waypoints"][1:])]
    print(f"route of {route['length_m']} m, largest step {max(steps):.3f} m, {route['ms']} ms")
    assert route["found"] and max(steps) <= 0.2
    ramps = atlas.run("plan", *ends, "--max-slope-deg", 20)  # they reach 18.5 degrees
    print(f"with --max-slope-deg 20: {ramps['length_m']} m")
    assert ramps["found"]
    track = atlas.run("localize", folder)
    print(f"tracked in its own map: {track['failures']} of {track['scans']} scans fail")
    assert track["failures"] <= 0.03 * track["scans"]
    refused = atlas.call("plan", *ends, "--max-slope-deg", 5)
    assert refused.returncode == 3 and json.loads(refused.stdout)["found"] is False
    # A keyframe in 3.4 m: what lies between two of them is known from having been driven on.
    with tempfile.TemporaryDirectory() as work:
        half = Atlas(atlas.bin, work)
        half.run("ingest", folder, "--scans", "even", "--every", 0)
        half.run("wait")
        route = half.run("plan", *ends)
        print(f"of its even scans: route of {route['length_m']} m")
        assert half.stop() == 0 and route["found"]


def localization(bin_dir):
    """Single shots from near starts and from far ones; and the paper's method, to the letter.

    What the latter reaches was measured elsewhere: ours is that one, not a weaker or a stronger one.
    """
    starts = {"0.4,1.5": Shots(), "3,10": Shots()}
    paper, flags = Shots(), ["--scans", "odd", "--rings", 16, "--max-range", 40]
    for piece in ("00", "02", "04", "08"):
        folder = drive(f"semantickitti_mini/{piece}")
        with tempfile.TemporaryDirectory() as work:
            atlas = Atlas(bin_dir, work, "--cell-size", "0.2", "--segments", "8", "--segment-height", "1")
            atlas.run("ingest", folder, "--scans", "even", "--every", 0, "--rings", 16, "--max-range", 40)
            atlas.run("wait")
            for perturb, pooled in starts.items():
                pooled.add(atlas.run("localize", folder, *flags, "--perturb", perturb, "--trials", 20))
            paper.add(atlas.run("localize", folder, *flags, "--perturb", "0.4,1.5", "--trials", 20, "--mode", "paper"))
            assert atlas.stop() == 0
    for perturb, pooled in starts.items():
        print(f"starts {perturb} off: {pooled}")
    for shots in starts.values():
        assert shots.failures == 0 and shots.shots == 400
        assert shots.translation() <= 0.025 and shots.rotation() <= 0.06
    print(f"the paper's method: {paper}")
    assert paper.failures == 0 and paper.shots == 400
    assert abs(paper.translation() / 0.108 - 1.0) <= 0.15 and abs(paper.rotation() / 0.36 - 1.0) <= 0.15
    near = starts["0.4,1.5"]
    assert near.translation() < 0.6 * paper.translation() and near.rotation() < 0.6 * paper.rotation()


def carried_copy(folder, work, kept):
    """Those of the drive's scans, as if nothing lay between them."""
    copy = pathlib.Path(work) / "carried"
    (copy / "velodyne").mkdir(parents=True)
    poses = (folder / "poses.txt").read_text().splitlines()
    for number, scan in enumerate(kept):
        (copy / f"velodyne/{number:06}.bin").symlink_to(folder / f"velodyne/{scan:06}.bin")
    (copy / "poses.txt").write_text("".join(poses[scan] + "\n" for scan in kept))
    return copy


def places(bin_dir):
    """Scans found alone, with no start; and a vehicle that is carried on, and told nothing."""
    with tempfile.TemporaryDirectory() as work:
        atlas = Atlas(bin_dir, work)
        folder = drive("kitti_0005")
        atlas.run("ingest", folder, "--scans", "even", "--every", 0)
        atlas.run("wait")
        found = atlas.run("localize", folder, "--scans", "odd", "--relocalize")
        print(f"kitti_0005, odd scans in the map of the even ones: {found}")
        assert found["wrong"] == 0 and found["right"] >= 0.95 * found["scans"] and found["scans"] == 77
        near = atlas.run("localize", folder, "--scans", "odd", "--relocalize", "--prior-radius", 20)
        assert near["wrong"] == 0 and near["right"] >= found["right"]
        elsewhere = atlas.run("localize", drive("semantickitti_mini/02"), "--relocalize")
        print(f"another drive in that map: {elsewhere}")
        assert elsewhere["right"] == elsewhere["wrong"] == 0
        carried = carried_copy(folder, work, [*range(21, 51, 2), *range(111, 151, 2)])
        done = atlas.call("localize", carried, "--no-restart", "--max-range", 40)
        rows = [json.loads(line) for line in done.stdout.splitlines()]
        assert atlas.stop() == 0
    after = rows[15:-1]
    back = next(i for i, row in enumerate(after) if row["health"] == "good" and row["error_m"] < 1.0)
    print(f"carried on by {60 * 0.46:.0f} m: held again at scan {back + 1} of {len(after)}")
    assert rows[-1]["restarts"] == 0 and back < 10
    assert not any(row["health"] == "good" and row["error_m"] > 1.0 for row in rows[:-1])


def moved_copy(folder, work, yaw_deg, shift_m):
    """The drive in another frame, turned about the vertical and shifted."""
    copy = pathlib.Path(work) / f"{folder.name}_moved"
    copy.mkdir()
    for name in ("velodyne", "times.txt"):
        if (folder / name).exists():
            (copy / name).symlink_to((folder / name).resolve())
    c, s = math.cos(math.radians(yaw_deg)), math.sin(math.radians(yaw_deg))
    lines = []
    for line in (folder / "poses.txt").read_text().splitlines():
        m = list(map(float, line.split()))
        east, north, up = m[0:4], m[4:8], m[8:12]
        rows = [[c * a - s * b for a, b in zip(east, north)], [s * a + c * b for a, b in zip(east, north)], up]
        for row, shift in zip(rows, shift_m):
            row[3] += shift
        lines.append(" ".join(repr(value) for row in rows for value in row) + "\n")
    (copy / "poses.txt").write_text("".join(lines))
    return copy


def anchor_errors(transform, moved, truth, scans):
    """How far off the transform puts these scans of the moved drive, in metres."""
    c, s = (f(math.radians(transform["yaw_deg"])) for f in (math.cos, math.sin))
    errors = []
    for scan in scans:
        x, y, z = moved[scan]
        put = (c * x - s * y + transform["x_m"], s * x + c * y + transform["y_m"], z + transform["z_m"])
        errors.append(math.dist(put, truth[scan]))
    return errors


def anchor(bin_dir):
    """Drives moved into frames of their own, found in the atlas again, or kept out of it."""
    with tempfile.TemporaryDirectory() as work:
        atlas = Atlas(bin_dir, work)
        folder = drive("kitti_0005")
        atlas.run("ingest", folder, "--session", "first", "--range", "0:77", "--every", 0)
        atlas.run("wait")
        before = atlas.run("digest")["digest"]
        unknown = atlas.call("ingest", drive("semantickitti_mini/02"), "--anchor", "--session", "elsewhere")
        told = json.loads(unknown.stdout)["anchors"][0]
        print(f"another drive: {told}")
        assert unknown.returncode == 3 and not told["anchored"]
        assert atlas.run("digest")["digest"] == before
        moved = moved_copy(folder, work, -71.25, (2000.5, 333.3, -12.0))
        done = atlas.run("ingest", moved, "--session", "second", "--anchor", "--scans", "odd", "--every", 0)
        told = done["anchors"][0]
        scans = range(1, 154, 2)
        errors = anchor_errors(told["transform"], positions(moved), positions(folder), scans)
        on_map = [error for scan, error in zip(scans, errors) if scan < 77]
        print(f"kitti_0005, odd scans in the map of its first half: {told}; off by {max(on_map):.3f} m at most on the "
              f"map, {max(errors):.3f} m at its other end")
        assert told["anchored"] and max(on_map) <= 0.06 and max(errors) <= 0.15
        assert atlas.stop() == 0
    with tempfile.TemporaryDirectory() as work:
        atlas = Atlas(bin_dir, work)
        atlas.run("ingest", drive("sim_overpass_A"))
        folder = drive("sim_overpass_B")
        moved = moved_copy(folder, work, 33.3, (-700.25, 41.5, 6.75))
        done = json.loads(atlas.call("ingest", moved, "--anchor").stdout)
        for told, scans in zip(done["anchors"], (range(121), range(121, 242)), strict=True):
            print(f"an interchange that looks the same from two sides: {told}")
            if told["anchored"]:
                assert max(anchor_errors(told["transform"], positions(moved), positions(folder), scans)) <= 0.5
        assert atlas.stop() == 0


def second(bin_dir):
    """Second drives of simulated worlds, the other way and in the other lane, tracked on their decks."""
    for world, goal_m in {"garage": 0.05}.items():
        with tempfile.TemporaryDirectory() as work:
            atlas = Atlas(bin_dir, work)
            for seed in (0, 1):
                subprocess.run([bin_dir / "atlas", "simulate", world, "-o", f"{work}/{seed}", "--seed", str(seed)],
                               check=True, stdout=subprocess.DEVNULL)
            atlas.run("ingest", f"{work}/0")
            atlas.run("wait")
            summary = atlas.run("localize", f"{work}/1", "--output", f"{work}/track.csv")
            # Carried to the deck below, after 30 scans.
            folder = carried_copy(pathlib.Path(work) / "1", work, [*range(30), *range(80, 140)])
            done = atlas.call("localize", folder, "--no-restart").stdout.splitlines()
            carried = [json.loads(line) for line in done[:-1]]
            assert atlas.stop() == 0
            with open(f"{work}/track.csv", newline="", encoding="ascii") as file:
                scans = list(csv.DictReader(file))
        held = sum(abs(float(scan["up_m"])) < 1.0 and scan["health"] != "lost" for scan in scans)
        print(f"{world}: {held} of {len(scans)} scans on their deck; {summary}")
        assert held == len(scans) == summary["scans"] and summary["failures"] == 0
        assert summary["translation_rmse_m"] <= goal_m
        good, wrong = good_and_wrong(carried)
        print(f"carried to another deck: {good} of {len(carried)} scans good, {wrong} of them on another")
        assert wrong <= 1 and good >= 35 and carried[-1]["error_m"] < 0.2


def one_deck_mapped(bin_dir, work, seed):
    """An atlas of the lowest deck of a garage alone; the drive of another seed is in WORK/SEED."""
    atlas = Atlas(bin_dir, work)
    for each in (0, seed):
        subprocess.run([bin_dir / "atlas", "simulate", "garage", "-o", f"{work}/{each}", "--seed", str(each)],
                       check=True, stdout=subprocess.DEVNULL)
    atlas.run("ingest", f"{work}/0", "--range", "0:60")
    atlas.run("wait")
    return atlas


def good_and_wrong(scans):
    """How many are called good, and how many of these are more than a metre off."""
    good = [scan for scan in scans if scan["health"] == "good"]
    return len(good), sum(scan["error_m"] > 1.0 for scan in good)


def unmapped(bin_dir):
    """A garage of which one deck is mapped: who drives off it goes on by his own motion, and is taken to no other deck."""
    with tempfile.TemporaryDirectory() as work:
        atlas = one_deck_mapped(bin_dir, work, 2)
        done = atlas.call("localize", f"{work}/2", "--no-restart").stdout.splitlines()
        assert atlas.stop() == 0
    scans = [json.loads(line) for line in done[:-1]]
    good, wrong = good_and_wrong(scans)
    print(f"one deck mapped: {good} of {len(scans)} scans good, {wrong} of them elsewhere; "
          f"the last one {scans[-1]['health']}, {scans[-1]['error_m']} m off")
    assert good >= 40 and wrong == 0
    assert scans[-1]["health"] == "lost" and scans[-1]["error_m"] < 1.0


def stand_still(folder, scan, pause_s):
    """The recorder pauses before that scan, and the vehicle with it."""
    times = [float(line) for line in (folder / "times.txt").read_text().splitlines()]
    (folder / "times.txt").write_text("".join(f"{time_s + (pause_s if number >= scan else 0.0):.6f}\n"
                                              for number, time_s in enumerate(times)))


def edges(bin_dir):
    """Maps that end in the middle of a deck, where more of another one was mapped, or on a ramp, which looks the same
    further on: nobody is good elsewhere, there or when he comes back to the map from where he was told to start, nor
    after he stood there while the recorder paused."""
    near = ("--prior-radius", 1, "--prior-height", 1)
    vague = ("--prior-radius", 2, "--prior-height", 1)
    for mapped, seed, scans, flags, pause, least in (
            ("80:130", 1, "111:216", (), None, 35), ("0:50", 1, "110:216", (*near, "--seed", 1), None, 50),
            ("0:90", 1, "150:216", near, None, 40), ("0:90", 2, "110:216", vague, None, 0),
            ("60:110", 1, "110:216", near, None, 40), ("20:60", 2, "0:40", near, 5, 28), ("20:60", 6, "0:40", near, 4, 28),
            ("90:140", 2, "80:120", (), 3, 30)):
        with tempfile.TemporaryDirectory() as work:
            atlas = Atlas(bin_dir, work)
            for drive, kept in ((0, mapped), (seed, scans)):
                subprocess.run([bin_dir / "atlas", "simulate", "garage", "-o", f"{work}/{drive}", "--seed", str(drive),
                                "--range", kept], check=True, stdout=subprocess.DEVNULL)
            if pause:
                stand_still(pathlib.Path(f"{work}/{seed}"), pause, 1.9)
            atlas.run("ingest", f"{work}/0")
            atlas.run("wait")
            done = atlas.call("localize", f"{work}/{seed}", *flags).stdout.splitlines()
            assert atlas.stop() == 0
        good, wrong = good_and_wrong([json.loads(line) for line in done[:-1]])
        print(f"scans {mapped} mapped, scans {scans} of seed {seed}, pause before {pause}: {good} of {len(done) - 1} good, {wrong} of them "
              "elsewhere")
        assert good >= least and wrong == 0


def times(bin_dir):
    """Scans that are missing where no times say so, one that is stamped late, and times that jitter: all of two worlds
    is mapped, and nobody is good elsewhere."""
    def stamp(folder, change):
        lines = (folder / "times.txt").read_text().splitlines()
        (folder / "times.txt").write_text("".join(f"{change(number, float(line)):.6f}\n"
                                                  for number, line in enumerate(lines)))

    def some_missing(folder):
        (folder / "times.txt").unlink()
        for number in range(100, 103):
            (folder / f"velodyne/{number:06}.bin").unlink()

    def late(scan, by_s):
        return lambda folder: stamp(folder, lambda number, time_s: time_s + (by_s if number == scan else 0.0))

    def whole_seconds(folder):
        stamp(folder, lambda number, time_s: math.floor(time_s))

    def set_back(folder):
        stamp(folder, lambda number, time_s: 3600.0 + time_s - (3600.0 if number >= 121 else 0.0))
        for number in range(130, 134):
            (folder / f"velodyne/{number:06}.bin").unlink()

    def jitter(folder):
        noise = random.Random(3)
        stamp(folder, lambda number, time_s: 1.0 + time_s + noise.gauss(0.0, 0.04))

    for world, seed, cases in (
            ("garage", 7, {"three missing": some_missing, "times jitter": jitter, "one late": late(37, 0.2),
                           "one later than the next": late(60, 0.6), "whole seconds": whole_seconds}),
            ("overpass", 1, {"one late": late(137, 0.1), "times jitter": jitter, "a clock set back, four missing": set_back})):
        with tempfile.TemporaryDirectory() as work:
            atlas = Atlas(bin_dir, work)
            for number in (0, seed):
                subprocess.run([bin_dir / "atlas", "simulate", world, "-o", f"{work}/{number}", "--seed", str(number)],
                               check=True, stdout=subprocess.DEVNULL)
            atlas.run("ingest", f"{work}/0")
            atlas.run("wait")
            for name, change in cases.items():
                folder = pathlib.Path(work) / name.replace(" ", "_")
                shutil.copytree(f"{work}/{seed}", folder)
                change(folder)
                done = atlas.call("localize", folder).stdout.splitlines()
                good, wrong = good_and_wrong([json.loads(line) for line in done[:-1]])
                print(f"{world}, {name}: {good} of {len(done) - 1} good, {wrong} of them elsewhere")
                assert good >= 0.95 * (len(done) - 1) and wrong == 0
                shutil.rmtree(folder)
            assert atlas.stop() == 0


def half(bin_dir):
    """Half an interchange, which looks the same from both sides, and little of what the other drive sees of it: who was
    adrift on the plain before it is found where he is, and who fits there twice is good at neither place."""
    with tempfile.TemporaryDirectory() as work:
        atlas = Atlas(bin_dir, work)
        atlas.run("ingest", drive("sim_overpass_A"), "--range", "0:120")
        atlas.run("wait")
        done = atlas.call("localize", drive("sim_overpass_B")).stdout.splitlines()
        assert atlas.stop() == 0
    scans = [json.loads(line) for line in done[:-1]]
    good, wrong = good_and_wrong(scans)
    held = sum(scan["error_m"] <= 1.0 for scan in scans[:121])
    print(f"half of an interchange: {good} of {len(scans)} good, {wrong} of them elsewhere; {held} of the first leg's 121 "
          "scans within 1 m")
    assert held >= 90 and good >= 5 and wrong == 0


def told(bin_dir):
    """The same garage, whoever starts off the map: told how high he is he is taken to no other deck, in none of three ways."""
    with tempfile.TemporaryDirectory() as work:
        atlas = one_deck_mapped(bin_dir, work, 1)
        near = ("--prior-height", 1, "--prior-radius", 1)
        tracked = atlas.call("localize", f"{work}/1", "--no-restart", *near).stdout.splitlines()
        alone = [json.loads(atlas.call("localize", f"{work}/1", "--scans", "odd", "--relocalize", *height).stdout
                            .splitlines()[-1]) for height in ((), ("--prior-height", 1.5))]
        up_m = float(pathlib.Path(f"{work}/1/poses.txt").read_text().splitlines()[110].split()[11])
        anchored = atlas.call("ingest", f"{work}/1", "--range", "110:150", "--anchor", "--prior-height",
                              f"{up_m + 0.5},1.5")
        states = [session["state"] for session in json.loads(anchored.stdout)["session_states"]]
        assert atlas.stop() == 0
    scans = [json.loads(line) for line in tracked[:-1]]
    good, wrong = good_and_wrong(scans)
    print(f"started off the map: {good} of {len(scans)} scans good, {wrong} of them elsewhere; the last one "
          f"{scans[-1]['health']}, {scans[-1]['error_m']} m off; alone {alone[0]['wrong']} wrong, with a height "
          f"{alone[1]['wrong']}, {alone[1]['right']} right; anchored: {anchored.returncode}, {states}")
    assert good >= 40 and wrong == 0 and scans[-1]["health"] == "good"
    assert alone[0]["wrong"] > 20, "else there is nothing to tell"
    assert alone[1]["wrong"] <= 1 and alone[1]["right"] >= alone[0]["right"]
    assert anchored.returncode == 3 and states == ["staged"]
    assert started_in_the_middle(bin_dir) == 0


def started_in_the_middle(bin_dir):
    """Scans called good elsewhere, of a vehicle that starts off the map: in an aisle, and in a turn."""
    elsewhere = 0
    with tempfile.TemporaryDirectory() as work:
        atlas = one_deck_mapped(bin_dir, work, 4)
        for start in (66, 84):
            subprocess.run([bin_dir / "atlas", "simulate", "garage", "-o", f"{work}/from{start}", "--seed", "4",
                            "--range", f"{start}:{start + 70}"], check=True, stdout=subprocess.DEVNULL)
            done = atlas.call("localize", f"{work}/from{start}", "--no-restart", "--prior-height", 0.3,
                              "--prior-radius", 0.3).stdout.splitlines()
            scans = [json.loads(line) for line in done[:-1]]
            good, wrong = good_and_wrong(scans)
            print(f"started off the map at scan {start}: {good} of {len(scans)} scans good, {wrong} of them elsewhere; "
                  f"the last one {scans[-1]['error_m']} m off")
            elsewhere += wrong
        assert atlas.stop() == 0
    return elsewhere


def raised_copy(folder, work, scans, up_m):
    """The drive, of which these scans' poses are so much higher."""
    copy = pathlib.Path(work) / f"{folder.name}_raised_{scans.start}_{up_m}"
    copy.mkdir()
    for name in ("velodyne", "times.txt"):
        (copy / name).symlink_to((folder / name).resolve())
    lines = []
    for scan, line in enumerate((folder / "poses.txt").read_text().splitlines()):
        numbers = line.split()
        numbers[11] = repr(float(numbers[11]) + (up_m if scan in scans else 0.0))
        lines.append(" ".join(numbers) + "\n")
    (copy / "poses.txt").write_text("".join(lines))
    return copy


def decks(bin_dir):
    """A drive through a garage of which a part is one deck too high, where each of its scans fits, too; and positions,
    that say on which deck it was."""
    with tempfile.TemporaryDirectory() as work:
        atlas = Atlas(bin_dir, work)
        for seed in (0, 4):
            subprocess.run([bin_dir / "atlas", "simulate", "garage", "-o", f"{work}/{seed}", "--seed", str(seed),
                            "--gnss", "0.3"], check=True, stdout=subprocess.DEVNULL)
        atlas.run("ingest", f"{work}/0")
        atlas.run("wait")
        drive_4 = pathlib.Path(work) / "4"
        for part, up_m in ((range(76, 96), 3.2), (range(12), -3.2)):
            done = atlas.call("ingest", raised_copy(drive_4, work, part, up_m), "--anchor")
            print(f"scans {part} {up_m} m higher: {json.loads(done.stdout)['anchors'][0]}")
            assert done.returncode == 3
        # On one deck alone scans do not tell which; positions do, and are not to be believed blindly.
        some = (drive_4, "--anchor", "--staged", "--range", "66:108")
        (pathlib.Path(work) / "elsewhere.txt").write_text("66 100 100 100 1\n")
        known = {}
        for name, positions in {"none": (), "right": ("--positions", drive_4 / "positions.txt"),
                                "wrong": ("--positions", f"{work}/elsewhere.txt")}.items():
            done = atlas.call("ingest", *some, *positions, "--session", name)
            known[name] = json.loads(done.stdout)["anchors"][0]
            print(f"one deck, positions {name}: {done.returncode}, {known[name]}")
        assert atlas.stop() == 0
    assert known["right"]["anchored"] and known["right"]["off_positions_m"] < 1.0
    assert not known["wrong"]["anchored"]


def ground(bin_dir):
    """The map's ground near the path, which mostly no ray reached, against labelled returns of other scans."""
    for piece in ("00", "02", "04", "08"):
        folder = drive(f"semantickitti_mini/{piece}")
        returns = ground_near_path(folder, 1.5)
        with tempfile.TemporaryDirectory() as work:
            atlas = Atlas(bin_dir, work)
            height = atlas.run("ingest", folder, "--every", 0)["sensor_height_m"]
            atlas.run("wait")
            errors = []
            for (x, y), heights in sorted(returns.items())[::max(1, len(returns) // 40)]:
                layers = atlas.run("point", (x + 0.5) / 10, (y + 0.5) / 10)["layers"]
                mean = sum(heights) / len(heights)
                errors.append(min((layer["z_m"] - mean for layer in layers), key=abs))
            assert atlas.stop() == 0
        median = sorted(errors)[len(errors) // 2]
        print(f"{piece}: sensor {height} m up, ground off by {median:+.3f} m in {len(errors)} cells (median)")
        assert abs(median) <= 0.02


def ground_near_path(folder, reach_m):
    """World cells of 0.1 m within reach of the path: heights of the labelled ground returns in each, three or more."""
    poses = [list(map(float, line.split())) for line in (folder / "poses.txt").read_text().splitlines()]
    heights = {}
    for scan, pose in zip(sorted((folder / "velodyne").iterdir()), poses):
        labels = struct.iter_unpack("<HH", (folder / "labels" / f"{scan.stem}.label").read_bytes())
        for (x, y, z, _), (label, _) in zip(struct.iter_unpack("<4f", scan.read_bytes()), labels):
            if label not in (40, 44, 48, 49, 60, 72) or x * x + y * y > 18 ** 2:
                continue
            east, north, up = (pose[r] * x + pose[r + 1] * y + pose[r + 2] * z + pose[r + 3] for r in (0, 4, 8))
            if any((east - p[3]) ** 2 + (north - p[7]) ** 2 < reach_m ** 2 for p in poses):
                heights.setdefault((math.floor(east * 10), math.floor(north * 10)), []).append(up)
    return {cell: ups for cell, ups in heights.items() if len(ups) >= 3}


def changed_copy(folder, work, first=0, raised_m=0.0):
    """The drive, its scans numbered from `first` on and the world's zero `raised_m` lower."""
    copy = pathlib.Path(work) / folder.name
    (copy / "velodyne").mkdir(parents=True)
    for scan in (folder / "velodyne").iterdir():
        (copy / "velodyne" / f"{int(scan.stem) + first:06}.bin").symlink_to(scan.resolve())
    lines = (folder / "poses.txt").read_text().splitlines()
    rows = [lines[0].split()] * first + [line.split() for line in lines]
    (copy / "poses.txt").write_text("".join(
        " ".join(row[:11] + [str(float(row[11]) + raised_m)]) + "\n" for row in rows))
    return copy


def judge_street(bin_dir, flags, **change):
    """What street_judge says of the map that ingest with these flags makes of kitti_0005."""
    with tempfile.TemporaryDirectory() as work:
        folder = changed_copy(drive("kitti_0005"), work, **change)
        atlas = Atlas(bin_dir, work)
        atlas.run("ingest", folder, *flags.split())
        atlas.run("wait")
        atlas.run("query", "--center", "35,9", "--radius", 100, "-o", work + "/tiles")
        assert atlas.stop() == 0
        judge = subprocess.run([bin_dir / "street_judge", folder, work + "/tiles"], stdout=subprocess.PIPE, check=True)
    return json.loads(judge.stdout)


def street(bin_dir):
    """What moves (walkers, a van ahead, a cyclist behind) leaves no trail where the vehicle drove; what stands is kept."""
    all_scans = "--every 0"
    cases = [("", {}), ("--every 5", {}), (all_scans, {}), (all_scans + " --rings 16", {}),
             ("", {"first": 130}),  # stretches of 256 sequence numbers that end within the drive
             (all_scans, {"raised_m": 0.3})]
    if float(os.environ.get("ATLAS_TEST_SCALE", "1")) >= 10:
        cases += [(flags, {}) for flags in ("--every 0.5", "--every 2", all_scans + " --deskew on", all_scans + " --scans even")]
        cases += [("", {"first": 210}), (all_scans, {"first": 130}), (all_scans, {"first": 210}), (all_scans, {"raised_m": 0.6})]
    for flags, change in cases:
        result = judge_street(bin_dir, flags, **change)
        squares = {name: count for name, count in result.items() if name != "occupied_on_path"}
        in_columns = {name: count["in_columns"] / count["squares"] for name, count in squares.items()}
        occupied = squares["asked"]["occupied"] / squares["asked"]["squares"]
        print(flags or "default", change, result, f"{occupied:.3f}", flush=True)
        assert result["occupied_on_path"] == 0
        assert result["standing"]["squares"] > 200 and in_columns["standing"] >= 0.95
        assert occupied >= 0.9
        # With a keyframe in 5 m few look into a square again once somebody left it.
        assert in_columns["moved"] <= (0.6 if flags == "--every 5" else 0.5), "what moves leaves trails"


class Shots:
    """Summaries of `atlas localize`, pooled over all shots that did not fail."""

    def __init__(self):
        self.shots, self.failures, self.hits, self.squares, self.angles = 0, 0, 0, 0.0, 0.0

    def add(self, summary):
        hits = summary["shots"] - summary["failures"]
        self.shots += summary["shots"]
        self.failures += summary["failures"]
        self.hits += hits
        self.squares += hits * summary["translation_rmse_m"] ** 2
        self.angles += hits * summary["rotation_rmse_deg"] ** 2

    def translation(self):
        return math.sqrt(self.squares / self.hits)

    def rotation(self):
        return math.sqrt(self.angles / self.hits)

    def __str__(self):
        return (f"{self.shots} shots: {self.translation():.4f} m, {self.rotation():.4f} deg, "
                f"{self.failures} failures")


def segmentation(bin_dir):
    """The paper's literal mode was measured elsewhere: ours is that one, not a weaker or a stronger one."""
    paper = {16: 0.965, 64: 0.917}
    for rings in (16, 64):
        f1 = {}
        for mode in ("atlas", "paper"):
            scores = []
            for piece in ("00", "02", "04", "08"):
                out = subprocess.run([bin_dir / "atlas", "segment", drive(f"semantickitti_mini/{piece}"),
                                      "--rings", str(rings), "--mode", mode, "--json"],
                                     stdout=subprocess.PIPE, check=True)
                scores.append(json.loads(out.stdout)["f1"])
            f1[mode] = sum(scores) / len(scores)
        print(f"{rings} rings: F1 {f1['atlas']:.4f}, paper mode {f1['paper']:.4f}")
        assert f1["atlas"] >= 0.972
        assert abs(f1["paper"] - paper[rings]) <= 0.005


def order(bin_dir):
    folder = drive("sim_overpass_A")
    digests = []
    for variant in (["--batch", 64], ["--shuffle", 1, "--batch", 1], ["--shuffle", 2, "--batch", 7]):
        with tempfile.TemporaryDirectory() as work:
            atlas = Atlas(bin_dir, work)
            atlas.run("ingest", folder, "--range", "0:60", *variant)
            if "--shuffle" in variant:
                assert atlas.stop(signal.SIGKILL) == -signal.SIGKILL
            else:
                assert atlas.stop() == 0
            atlas.start()
            again = atlas.run("ingest", folder, "--range", "0:60")
            assert again["duplicates"] == again["acked"] == again["keyframes"]
            digests.append(atlas.run("digest")["digest"])
            report = atlas.run("verify", "--rebuild")
            assert report["mismatched"] == 0 and report["damaged"] == 0 and report["checked"] > 0
            assert atlas.stop() == 0
    print("digests:", sorted(set(digests)))
    assert len(set(digests)) == 1


def main():
    bin_dir, name = pathlib.Path(sys.argv[1]), sys.argv[2]
    if name in ("overpass", "garage"):
        with tempfile.TemporaryDirectory() as work:
            atlas = Atlas(bin_dir, work)
            try:
                {"overpass": overpass, "garage": garage}[name](atlas)
            finally:
                assert atlas.stop() == 0
    else:
        {"localization": localization, "places": places, "anchor": anchor, "second": second, "unmapped": unmapped,
         "edges": edges, "times": times, "half": half, "told": told, "decks": decks, "segmentation": segmentation, "order": order,
         "ground": ground, "street": street}[name](bin_dir)


if __name__ == "__main__":
    main()
