"""Merged sessions beside the true poses: how far they are from each other, from the truth, and what of their meetings
was found."""

import csv
import json
import subprocess
import sys
import time
import os

import numpy

NEAR_M, DECK_M, WRONG_M, WRONG_DEG, ALONG, MAPPED_M = 5.0, 1.0, 0.5, 3.0, 8, 10.0


def matrices(lines):
    rows = numpy.array([[float(word) for word in line.split()] for line in lines]).reshape(-1, 3, 4)
    poses = numpy.tile(numpy.eye(4), (len(rows), 1, 1))
    poses[:, :3, :] = rows
    return poses


def read_poses(file):
    return matrices(file.read_text().splitlines())


def pose_lines(poses):
    return "".join(" ".join(f"{value:.9g}" for value in pose[:3].ravel()) + "\n" for pose in poses)


def degrees(rotations):
    trace = numpy.trace(rotations, axis1=-2, axis2=-1)
    return numpy.degrees(numpy.arccos(numpy.clip((trace - 1.0) / 2.0, -1.0, 1.0)))


def rms(values):
    return float(numpy.sqrt(numpy.mean(numpy.square(values)))) if len(values) else 0.0


class Visit:
    """A session: its true poses, and those that it has now, by sequence number; `stored`: what is in the atlas."""

    def __init__(self, folder):
        self.truth = read_poses(folder / "truth.txt")
        self.poses = read_poses(folder / "poses.txt")
        self.stored = []


def visits_after(folders, corrections):
    """As a file of corrections has them, of car0, car1, ...; nearly all that ingest took moves in a merge."""
    visits = [Visit(folder) for folder in folders]
    for line in corrections.read_text().splitlines():
        if line.startswith("#"):
            continue
        words = line.split()
        visit = visits[int(words[0].removeprefix("car"))]
        visit.stored.append(int(words[2]))
        visit.poses[int(words[2])] = matrices([" ".join(words[3:])])[0]
    return visits


def visits_before(folders, visits):
    before = [Visit(folder) for folder in folders]
    for one, after in zip(before, visits):
        one.stored = after.stored
    return before


def distances(pose, others):
    """To places on the same deck; others are far away."""
    away = others[:, :3, 3] - pose[:3, 3]
    return numpy.where(numpy.abs(away[:, 2]) > DECK_M, numpy.inf, numpy.linalg.norm(away, axis=1))


def between(one, other):
    """How far keyframes of two sessions that were within 5 m are from where they should be to each other."""
    metres, turns = [], []
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


def relative(visits):
    """Of all pairs of sessions, metres and degrees."""
    pairs = [between(one, other) for i, one in enumerate(visits) for other in visits[i + 1:]]
    return [value for metres, _ in pairs for value in metres], [value for _, turns in pairs for value in turns]


def relative_to_last(visits):
    pairs = [between(visits[-1], other) for other in visits[:-1]]
    return [value for metres, _ in pairs for value in metres], [value for _, turns in pairs for value in turns]


def overall(visits):
    """The same after all are laid on the truth (Umeyama, no scale)."""
    poses = numpy.concatenate([visit.poses[visit.stored] for visit in visits])
    truth = numpy.concatenate([visit.truth[visit.stored] for visit in visits])
    a, b = poses[:, :3, 3], truth[:, :3, 3]
    u, _, v = numpy.linalg.svd((a - a.mean(0)).T @ (b - b.mean(0)))
    turn = v.T @ numpy.diag([1.0, 1.0, numpy.linalg.det(v.T @ u.T)]) @ u.T
    off = (a - a.mean(0)) @ turn.T - (b - b.mean(0))
    return numpy.linalg.norm(off, axis=1), degrees(numpy.swapaxes(turn @ poses[:, :3, :3], 1, 2) @ truth[:, :3, :3])


def closures_of(report, visits):
    """(session, sequence) of both ends."""
    index = {f"car{i}": i for i in range(len(visits))}
    return [tuple((index[end["vehicle"]], end["sequence"]) for end in (closure["a"], closure["b"]))
            for closure in report["closures"]]


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


def laid_into(visits, truth):
    """True poses of another drive as the map of the visits has them: by the mean of the keyframes within 10 m, which are
    what the map there was fused of."""
    owners = [(visit, k) for visit in visits for k in visit.stored]
    nearby = numpy.array([visit.truth[k] for visit, k in owners])
    laid = []
    for pose in truth:
        away = distances(pose, nearby)
        chosen = numpy.flatnonzero(away <= max(MAPPED_M, away.min()))
        moved = numpy.array([owners[i][0].poses[owners[i][1]] @ numpy.linalg.inv(nearby[i]) @ pose for i in chosen])
        mean = numpy.eye(4)
        u, _, v = numpy.linalg.svd(moved[:, :3, :3].sum(0))  # the rotation nearest to all of them
        mean[:3, :3] = u @ v
        mean[:3, 3] = moved[:, :3, 3].mean(0)
        laid.append(mean)
    return numpy.array(laid)


def localization_errors(rows_file):
    """Of the scans that were found within 1 m, and how many were not."""
    with open(rows_file, newline="", encoding="ascii") as file:
        rows = list(csv.DictReader(file))
    hits = [row for row in rows if row["health"] != "lost" and float(row["error_m"]) <= 1.0]
    return (rms([float(row["error_m"]) for row in hits]), rms([float(row["error_deg"]) for row in hits]),
            len(rows) - len(hits))


def timed(command):
    """The JSON that it prints, and what it cost."""
    began = time.monotonic()
    process = subprocess.Popen([str(part) for part in command], stdout=subprocess.PIPE, text=True)
    report = json.loads(process.stdout.read())
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(process.returncode)
    return report, {"seconds": time.monotonic() - began, "cpu_s": used.ru_utime + used.ru_stime,
                    "memory_mb": used.ru_maxrss / 1000.0}
