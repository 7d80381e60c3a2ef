"""Merging: sessions of one simulated city, and of one garage, each with a drift of its own, uploaded staged, merged by
`atlas-merge run`, and compared with the true poses."""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

import numpy

from bench_daemon import Atlas

IMAGES = pathlib.Path(__file__).parent.parent / "docs/images"
EVERY_M = 1.0
CITY = [(0, 760), (660, 1420), (1320, 2080), (1980, 2712)]  # scans of the trajectory, overlapping
# A garage: one session from deck to deck, two on a deck or two each.
GARAGE = [("0", 0, 216), ("2", 24, 66), ("4", 120, 162)]
NEAR_M, DECK_M, WRONG_M, WRONG_DEG, ALONG = 5.0, 1.0, 0.5, 3.0, 8


def matrices(lines):
    rows = numpy.array([[float(word) for word in line.split()] for line in lines]).reshape(-1, 3, 4)
    poses = numpy.tile(numpy.eye(4), (len(rows), 1, 1))
    poses[:, :3, :] = rows
    return poses


def read_poses(file):
    return matrices(file.read_text().splitlines())


def degrees(rotations):
    trace = numpy.trace(rotations, axis1=-2, axis2=-1)
    return numpy.degrees(numpy.arccos(numpy.clip((trace - 1.0) / 2.0, -1.0, 1.0)))


def rms(values):
    return float(numpy.sqrt(numpy.mean(numpy.square(values)))) if len(values) else 0.0


class Visit:
    """A session: its true poses, and those that it has now, by sequence number."""

    def __init__(self, folder):
        self.truth = read_poses(folder / "truth.txt")
        self.poses = read_poses(folder / "poses.txt")
        self.stored = []

    def correct(self, words):
        self.poses[int(words[2])] = matrices([" ".join(words[3:])])[0]


def distances(pose, others):
    """To places on the same deck; others are far away."""
    away = others[:, :3, 3] - pose[:3, 3]
    return numpy.where(numpy.abs(away[:, 2]) > DECK_M, numpy.inf, numpy.linalg.norm(away, axis=1))


def relative(visits):
    """How far keyframes of two sessions that were within 5 m are from where they should be to each other."""
    metres, turns = [], []
    for i, one in enumerate(visits):
        for other in visits[i + 1:]:
            for k in one.stored if other.stored else []:
                away = distances(one.truth[k], other.truth[other.stored])
                nearest = int(away.argmin())
                if away[nearest] > NEAR_M:
                    continue
                m = other.stored[nearest]
                is_so = numpy.linalg.inv(one.poses[k]) @ other.poses[m]
                should = numpy.linalg.inv(one.truth[k]) @ other.truth[m]
                off = numpy.linalg.inv(should) @ is_so
                metres.append(numpy.linalg.norm(off[:3, 3]))
                turns.append(degrees(off[:3, :3]))
    return metres, turns


def overall(visits):
    """The same after all are laid on the truth (Umeyama, no scale)."""
    poses = numpy.concatenate([visit.poses[visit.stored] for visit in visits])
    truth = numpy.concatenate([visit.truth[visit.stored] for visit in visits])
    a, b = poses[:, :3, 3], truth[:, :3, 3]
    u, _, v = numpy.linalg.svd((a - a.mean(0)).T @ (b - b.mean(0)))
    turn = v.T @ numpy.diag([1.0, 1.0, numpy.linalg.det(v.T @ u.T)]) @ u.T
    off = (a - a.mean(0)) @ turn.T - (b - b.mean(0))
    return numpy.linalg.norm(off, axis=1), degrees(numpy.swapaxes(turn @ poses[:, :3, :3], 1, 2) @ truth[:, :3, :3])


def closures_of(report, index):
    """(session, sequence) of both ends."""
    for closure in report["closures"]:
        yield tuple((index[(end["vehicle"], end["session"])], end["sequence"]) for end in (closure["a"], closure["b"]))


def wrong_closures(visits, closures):
    """Places that were taken for one and are not."""
    wrong = 0
    for (i, k), (j, m) in closures:
        off = (numpy.linalg.inv(numpy.linalg.inv(visits[i].truth[k]) @ visits[j].truth[m])
               @ numpy.linalg.inv(visits[i].poses[k]) @ visits[j].poses[m])
        wrong += numpy.linalg.norm(off[:3, 3]) > WRONG_M or degrees(off[:3, :3]) > WRONG_DEG
    return int(wrong)


def overlaps(visits, closures):
    """Keyframes within 5 m of another session, and those of them near which a closure with it was found."""
    found = {}
    for (i, k), (j, m) in closures:
        found.setdefault((i, j), []).append(k)
        found.setdefault((j, i), []).append(m)
    near = seen = 0
    for i, one in enumerate(visits):
        for j, other in enumerate(visits):
            if i == j:
                continue
            for k in range(len(one.truth)):
                if distances(one.truth[k], other.truth).min() > NEAR_M:
                    continue
                near += 1
                seen += any(abs(k - other_k) <= ALONG for other_k in found.get((i, j), []))
    return seen, near


def simulate(bin_dir, world, folder, *flags):
    subprocess.run([bin_dir / "atlas", "simulate", world, "-o", folder, *flags], check=True, stdout=subprocess.DEVNULL)
    return folder


def run_merge(bin_dir, atlas, corrections, picture):
    """The report, and what it cost."""
    began = time.monotonic()
    process = subprocess.Popen([bin_dir / "atlas-merge", "run", "--json", "--server", atlas.server, "--corrections",
                                corrections, "--picture", picture], stdout=subprocess.PIPE, text=True)
    report = json.loads(process.stdout.read())
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(process.returncode)
    return report, {"seconds": time.monotonic() - began, "cpu_s": used.ru_utime + used.ru_stime,
                    "memory_mb": used.ru_maxrss / 1000.0}


def merge(bin_dir, emit, name, folders, work):
    """Uploads, merges and compares: the report, the visits as they are, how far they were, what it cost."""
    with Atlas(bin_dir) as atlas:
        for i, folder in enumerate(folders):
            atlas.run("ingest", folder, "--vehicle", f"car{i}", "--session", "day", "--staged")
        corrections = work / f"{name}.txt"
        report, cost = run_merge(bin_dir, atlas, corrections, work / f"{name}.png")
        atlas.run("wait", "--timeout", "3000")
        atlas.run("verify", "--rebuild", "--timeout", "3000")  # or it fails: tiles are what these poses make
    visits = [Visit(folder) for folder in folders]
    moves = [line.split() for line in corrections.read_text().splitlines() if not line.startswith("#")]
    for words in moves:  # nearly all that ingest took: a few do not move
        visits[int(words[0].removeprefix("car"))].stored.append(int(words[2]))
    before = relative(visits)
    for words in moves:
        visits[int(words[0].removeprefix("car"))].correct(words)
    return report, visits, before, cost


def report_merge(emit, name, asked, report, visits, before, cost):
    index = {(f"car{i}", "day"): i for i in range(len(visits))}
    closures = list(closures_of(report, index))
    metres, turns = relative(visits)
    off_m, off_deg = overall(visits)
    seen, near = overlaps(visits, closures)
    emit(f"merge.{name}.joined", sum(session["joined"] for session in report["sessions"]),
         f"of {len(visits)} sessions", "asked", len(visits))
    emit(f"merge.{name}.before.relative", rms(before[0]), "m", "none", None)
    emit(f"merge.{name}.relative", rms(metres), f"m, {len(metres)} pairs within {NEAR_M:g} m", "asked", asked["relative_m"])
    emit(f"merge.{name}.relative_turn", rms(turns), "deg", "asked", 0.1)
    emit(f"merge.{name}.overall", rms(off_m), "m, after alignment", "asked", 0.3)
    emit(f"merge.{name}.overall_turn", rms(off_deg), "deg, after alignment", "asked", 0.2)
    emit(f"merge.{name}.wrong", wrong_closures(visits, closures), f"of {len(closures)} closures", "asked", 0)
    emit(f"merge.{name}.overlaps", seen / max(1, near), f"of {near} keyframes near another session", "asked", 0.9)
    emit(f"merge.{name}.seconds", cost["seconds"], "s", "asked", 600)
    emit(f"merge.{name}.cpu", cost["cpu_s"], "s of CPU", "none", None)
    emit(f"merge.{name}.memory", cost["memory_mb"], "MB", "asked", 2000)


def bench_merge(bin_dir, emit, drive):
    trajectory = drive("kitti_trajectories") / "00.txt"
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        city = [simulate(bin_dir, "city", work / f"city{i}", "--trajectory", trajectory, "--every", str(EVERY_M),
                         "--range", f"{begin}:{end}", "--seed", str(i + 1), "--drift", str(i + 21))
                for i, (begin, end) in enumerate(CITY)]
        report, visits, before, cost = merge(bin_dir, emit, "city", city, work)
        report_merge(emit, "city", {"relative_m": 0.05}, report, visits, before, cost)
        shutil.copy(work / "city.png", IMAGES / "merge.png")
        garage = [simulate(bin_dir, "garage", work / f"garage{i}", "--seed", seed, "--range", f"{begin}:{end}",
                           "--drift", str(i + 31)) for i, (seed, begin, end) in enumerate(GARAGE)]
        report, visits, before, cost = merge(bin_dir, emit, "garage", garage, work)
        report_merge(emit, "garage", {"relative_m": 0.08}, report, visits, before, cost)


BENCHMARKS = {"merge": bench_merge}
