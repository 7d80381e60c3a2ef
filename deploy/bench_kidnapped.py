"""Kidnapped vehicles: stretches of second drives through simulated worlds (another lane or direction, other noise), cut
together as if the vehicle had been carried from one to the other, localized in the map of a first drive. How soon it is
back, and whether it ever says good elsewhere."""

import pathlib
import random
import subprocess
import tempfile

from bench_daemon import Atlas, rows_of

BACK_S, AWAY_M = 3.0, 1.0  # what was asked; an answer this far off is another place
BEFORE, AFTER = 25, 60     # scans of the two stretches, which are drawn
SEED = 1
# world, seed of the mapping drive, of the others, and how often one is carried
WORLDS = [("garage", 4, (5, 7, 9, 12, 20), 24), ("overpass", 0, (3, 7, 9, 14), 15), ("street", 0, (2, 7, 12), 6)]


def simulate(bin_dir, world, seed, folder):
    if not folder.is_dir():
        subprocess.run([bin_dir / "atlas", "simulate", world, "--seed", str(seed), "-o", folder], check=True,
                       stdout=subprocess.DEVNULL)
    return folder


def cut(folder, target, before, after):
    """Those scans of a drive, at its pace."""
    poses = (folder / "poses.txt").read_text().splitlines()
    times = [float(time) for time in (folder / "times.txt").read_text().split()]
    (target / "velodyne").mkdir(parents=True)
    kept = [*range(*before), *range(*after)]
    for number, scan in enumerate(kept):
        (target / f"velodyne/{number:06}.bin").symlink_to(folder / f"velodyne/{scan:06}.bin")
    (target / "poses.txt").write_text("".join(poses[scan] + "\n" for scan in kept))
    (target / "times.txt").write_text("".join(f"{times[number]}\n" for number in range(len(kept))))
    return times[1] - times[0]


def judge(rows, jump):
    """Of the scans from the jump on: the first that is good and in its place (None: none is), how many are good
    elsewhere, how many weak and lost; and whether the last is in its place."""
    after = rows[jump:]
    good = [row["health"] == "good" for row in after]
    there = [row["error_m"] is not None and row["error_m"] <= AWAY_M for row in after]
    back = next((i for i in range(len(after)) if good[i] and there[i]), None)
    return {"back": back, "wrongly_good": sum(g and not t for g, t in zip(good, there)),
            "weak": sum(row["health"] == "weak" for row in after),
            "lost": sum(row["health"] == "lost" for row in after), "ends_there": good[-1] and there[-1]}


def kidnap(bin_dir, database, drives, world, seed, draw, number):
    """Carried once; what `judge` says, and the time between scans."""
    drive = simulate(bin_dir, world, seed, drives / f"drive{seed}")
    scans = len((drive / "poses.txt").read_text().splitlines())
    before, after = draw.randrange(scans - BEFORE), draw.randrange(scans - AFTER)
    folder = drives / f"cut{number}"
    pace_s = cut(drive, folder, (before, before + BEFORE), (after, after + AFTER))
    *rows, _ = rows_of(bin_dir / "atlas", "--json", "localize", "--atlas", database, folder, "--no-restart")
    return {**judge(rows, BEFORE), "pace_s": pace_s}


def bench_kidnapped(bin_dir, emit, _):
    with tempfile.TemporaryDirectory() as work:
        for world, map_seed, seeds, times in WORLDS:
            draw = random.Random(SEED)
            drives = pathlib.Path(work) / world
            with Atlas(bin_dir) as atlas:
                atlas.run("ingest", simulate(bin_dir, world, map_seed, drives / f"drive{map_seed}"))
                atlas.run("wait", "--timeout", "3000")
                atlas.stop()
                results = [kidnap(bin_dir, atlas.database, drives, world, draw.choice(seeds), draw, number)
                           for number in range(times)]
            back = sorted(one["back"] * one["pace_s"] for one in results if one["back"] is not None)
            emit(f"kidnapped.{world}.in_time", sum(time_s <= BACK_S for time_s in back), f"of {times}", "none", None)
            emit(f"kidnapped.{world}.back", back[len(back) // 2] if back else -1, "s until it is back, median", "asked",
                 BACK_S)
            emit(f"kidnapped.{world}.back.worst", back[-1] if len(back) == times else -1,
                 "s until it is back (-1: it never is)", "asked", BACK_S)
            for name in ("wrongly_good", "weak", "lost"):
                emit(f"kidnapped.{world}.{name}", sum(one[name] for one in results), f"scans of {times * AFTER}", "none",
                     None)
            emit(f"kidnapped.{world}.in_place_at_the_end", sum(one["ends_there"] for one in results), f"of {times}",
                 "none", None)


BENCHMARKS = {"kidnapped": bench_kidnapped}
