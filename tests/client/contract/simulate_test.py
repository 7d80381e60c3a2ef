#!/usr/bin/python3
"""What `atlas simulate` writes about cars that move or come and go, what it refuses of them, and what a signal leaves.
Usage: simulate_test.py BIN_DIR"""

import json
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))

from harness import EXIT, Report

DAY_S = 86_400
SHORT_WAY_M = 100
CITY_WAY_M = 160
CAR_CLASS, MOVING_CAR_CLASS = 10, 252


class Simulation:
    def __init__(self, report, bin_dir, work):
        self.report = report
        self.atlas = bin_dir / "atlas"
        self.work = work
        self.drives = 0

    def call(self, *args):
        folder = self.work / f"drive{self.drives}"
        self.drives += 1
        done = subprocess.run([self.atlas, "simulate", *map(str, args), "-o", folder, "--json"], text=True,
                              capture_output=True, check=False)
        return folder, done

    def drive(self, *args):
        folder, done = self.call(*args)
        assert done.returncode == 0, f"{args}: {done.stderr}"
        return folder

    def refused(self, name, args, says):
        folder, done = self.call(*args)
        self.report.equal(f"{name}: exit code", done.returncode, EXIT["invalid_argument"])
        error = json.loads(done.stderr)["error"]
        self.report.check(f"{name}: message", error["code"] == "invalid_argument" and says in error["message"], error)
        self.report.check(f"{name}: nothing is left", not folder.exists(), folder)


def boxes(folder):
    """(scan or "all", class, x, y, z) of each line."""
    found = []
    for line in (folder / "boxes.txt").read_text(encoding="ascii").splitlines():
        words = line.split()
        assert len(words) == 17, line
        found.append((words[0], int(words[1]), float(words[5]), float(words[9]), float(words[13])))
    return found


def write_mesh(path):
    """A street between two walls."""
    half = SHORT_WAY_M / 2 + 40
    corners = [(x, y, z) for x in (-half, half) for y in (-6, 6) for z in (0, 5)]
    faces = [(1, 5, 7, 3), (1, 2, 6, 5), (3, 7, 8, 4)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + ["f " + " ".join(map(str, face)) for face in faces]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def write_poses(path, length_m, every_m=1):
    path.write_text("".join(f"1 0 0 {x - length_m / 2} 0 1 0 0 0 0 1 1.8\n"
                            for x in range(0, length_m + 1, every_m)), encoding="ascii")


def parked_cases(simulation):
    report = simulation.report
    way = simulation.work / "city_way.txt"
    write_poses(way, CITY_WAY_M, every_m=4)
    visits = {day: simulation.drive("city", "--trajectory", way, "--parked", day) for day in (0, 1, 3)}
    for day, folder in visits.items():
        times = [float(line) for line in (folder / "times.txt").read_text(encoding="ascii").split()]
        report.equal(f"day {day}: the first scan", times[0], float(DAY_S * day))
        report.check(f"day {day}: not a day long", times[-1] < DAY_S * (day + 1), times[-1])
    parked = {day: [box for box in boxes(folder) if box[0] == "all"] for day, folder in visits.items()}
    report.equal("nobody came on day 0", parked[0], [])
    report.check("some parked on day 1", len(parked[1]) > 3 and {box[1] for box in parked[1]} == {CAR_CLASS},
                 parked[1])
    report.check("others parked on day 3", parked[3] != parked[1], parked[3])
    again = simulation.drive("city", "--trajectory", way, "--parked", 1, "--seed", 2)
    report.equal("who drives there sees the same", [box for box in boxes(again) if box[0] == "all"], parked[1])
    simulation.refused("a garage has no slots", ["garage", "--parked", 1], "--parked is for street and city")
    simulation.refused("a day to come", ["street", "--parked", 20_001], "expected a day up to 20000")


def convoy_cases(simulation):
    """In a mesh whose name is in capitals: its boxes grow with the way, not with its square."""
    report = simulation.report
    mesh, poses = simulation.work / "STREET.OBJ", simulation.work / "poses.txt"
    write_mesh(mesh)
    lines = {}
    for length_m in (SHORT_WAY_M // 2, SHORT_WAY_M):
        write_poses(poses, length_m)
        way = [mesh, "--trajectory", poses]
        report.equal(f"{length_m} m: nothing moves unasked", boxes(simulation.drive(*way)), [])
        found = boxes(simulation.drive(*way, "--traffic"))
        report.equal(f"{length_m} m: all are moving cars", {box[1] for box in found}, {MOVING_CAR_CLASS})
        away = {round(x - (int(scan) - length_m / 2)) for scan, _, x, _, _ in found}
        report.equal(f"{length_m} m: one ahead, one behind", away, {13, -12})
        report.equal(f"{length_m} m: boxes, but for the ends of the way", len(found),
                     2 * (length_m + 1) - 13 - 12)
        lines[length_m] = len(found)
    report.equal("boxes of 50 m more", lines[SHORT_WAY_M] - lines[SHORT_WAY_M // 2], SHORT_WAY_M)
    simulation.refused("a mesh has no slots", [mesh, "--trajectory", poses, "--parked", 1], "--parked is for")
    for world in ("street", "overpass", "city"):
        simulation.refused(f"{world} has its own", [world, "--traffic"], "--traffic is for garage and FILE.obj")


def interrupted_case(simulation):
    report = simulation.report
    for number in (signal.SIGTERM, signal.SIGINT):
        folder = simulation.work / f"interrupted{number}"
        partial = folder.with_name(folder.name + ".partial")
        process = subprocess.Popen([simulation.atlas, "simulate", "city", "-o", folder], stderr=subprocess.DEVNULL)
        try:
            deadline = time.monotonic() + 60
            while not list(partial.glob("velodyne/*.bin")) and process.poll() is None and time.monotonic() < deadline:
                time.sleep(0.01)
            report.check(f"signal {number}: it was at work", process.poll() is None and partial.is_dir(), partial)
            process.send_signal(number)
            report.equal(f"signal {number}: it ends by it", process.wait(60), -number)
        finally:
            process.kill()
            process.wait()
        report.check(f"signal {number}: nothing is left", not folder.exists() and not partial.exists(), folder)


def main():
    report = Report()
    with tempfile.TemporaryDirectory() as work:
        simulation = Simulation(report, pathlib.Path(sys.argv[1]), pathlib.Path(work))
        parked_cases(simulation)
        convoy_cases(simulation)
        interrupted_case(simulation)
    print(f"{report.checks} checks, {report.failed} failed")
    return 1 if report.failed else 0


if __name__ == "__main__":
    sys.exit(main())
