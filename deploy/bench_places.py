"""Places: each scan of a second drive through a simulated city found alone, with no start; and a vehicle that is
carried from one end of the city to the other. The city stands along a recorded trajectory of 3.7 km with loops."""

import pathlib
import subprocess
import tempfile

from bench_daemon import Atlas, rows_of

MAP_EVERY_M, QUERY_EVERY_M = 0.9, 1.3  # between scans: 2,030 queries
STRETCH, STRETCHES = 60, 8             # scans that the vehicle drives between two abductions
RIGHT, WRONG, CPU_S, BACK_SCANS = 0.95, 4, 0.5, 30  # what was asked


def simulate(bin_dir, trajectory, folder, every_m, *flags):
    subprocess.run([bin_dir / "atlas", "simulate", "city", "--trajectory", trajectory, "--every", str(every_m),
                    "-o", folder, *flags], check=True, stdout=subprocess.DEVNULL)


def abduct(folder, target):
    """Stretches of the drive one after the other, each from another part of it."""
    scans = sorted((folder / "velodyne").iterdir())
    poses = (folder / "poses.txt").read_text().splitlines()
    (target / "velodyne").mkdir(parents=True)
    kept = []
    for part in range(STRETCHES):
        begin = len(scans) * (part * 3 % STRETCHES) // STRETCHES
        for i in range(begin, begin + STRETCH):
            (target / f"velodyne/{len(kept):06}.bin").symlink_to(scans[i])
            kept.append(poses[i])
    (target / "poses.txt").write_text("\n".join(kept) + "\n")


def scans_until_back(rows):
    """Of each abduction: scans until one is held within a metre; and those called good that are not."""
    back, wrongly_good = [], 0
    for part in range(1, STRETCHES):
        stretch = rows[part * STRETCH:(part + 1) * STRETCH]
        held = [row["health"] != "lost" and row["error_m"] <= 1.0 for row in stretch]
        back.append(held.index(True) + 1 if True in held else STRETCH + 1)
        wrongly_good += sum(row["health"] == "good" and row["error_m"] > 1.0 for row in stretch)
    return back, wrongly_good


def bench_places(bin_dir, emit, drive):
    trajectory = drive("kitti_trajectories") / "00.txt"
    with tempfile.TemporaryDirectory() as work, Atlas(bin_dir) as atlas:
        first, second, carried = (pathlib.Path(work) / name for name in ("first", "second", "carried"))
        simulate(bin_dir, trajectory, first, MAP_EVERY_M)
        simulate(bin_dir, trajectory, second, QUERY_EVERY_M, "--seed", "5")
        abduct(second, carried)
        atlas.run("ingest", first)
        atlas.run("wait", "--timeout", "3000")
        atlas.stop()
        localize = [bin_dir / "atlas", "--json", "localize", "--atlas", atlas.database]
        *_, summary = rows_of(*localize, second, "--relocalize")
        emit("places.queries", summary["scans"], f"in a map of {summary['places']} places", "none", None)
        emit("places.right", summary["right"] / summary["scans"], "within 0.5 m", "asked", RIGHT)
        emit("places.wrong", summary["wrong"], "of all", "asked", WRONG)
        emit("places.unknown", summary["unknown"], "of all", "none", None)
        emit("places.error", summary["translation_rmse_m"], "m RMSE", "none", None)
        emit("places.cpu", summary["cpu_s_per_scan"], "s a query, mean", "asked", CPU_S)
        emit("places.cpu.worst", summary["worst_cpu_s"], "s a query", "asked", CPU_S)
        *rows, _ = rows_of(*localize, carried, "--no-restart", "--max-range", "40")
        back, wrongly_good = scans_until_back(rows)
        emit("places.carried.worst", max(back), f"scans until it is back, of {len(back)} times", "asked", BACK_SCANS)
        emit("places.carried.wrongly_good", wrongly_good, "scans", "none", None)


BENCHMARKS = {"places": bench_places}
