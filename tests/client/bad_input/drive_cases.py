"""Folders of scans that are not what they should be: `ingest`, `segment` and `localize`."""

import math
import struct

from harness import NEAR, Drives


def spoil_floats(path, places, value):
    data = bytearray(path.read_bytes())
    for place in places:
        struct.pack_into("<f", data, 4 * place, value)
    path.write_bytes(data)


def truncated(folder):
    scan = folder / "velodyne/000003.bin"
    scan.write_bytes(scan.read_bytes()[:-5])


def empty(folder):
    (folder / "velodyne/000003.bin").write_bytes(b"")


def coordinate(value, place=4 * 70 + 1):
    return lambda folder: spoil_floats(folder / "velodyne/000003.bin", [place], value)


def all_nan(folder):
    scan = folder / "velodyne/000003.bin"
    count = scan.stat().st_size // 16
    spoil_floats(scan, [4 * i + k for i in range(count) for k in range(3)], math.nan)


def folder_for_a_scan(folder):
    (folder / "velodyne/000003.bin").unlink()
    (folder / "velodyne/000003.bin").mkdir()


def same_number_twice(folder):
    (folder / "velodyne/3.bin").write_bytes((folder / "velodyne/000003.bin").read_bytes())


def first_of(*lines):
    return lambda folder: (folder / "times.txt").write_text("\n".join(lines) + "\n", encoding="ascii")


SCANS = {
    "truncated scan": (truncated, "000003.bin"),
    "empty scan": (empty, "000003.bin"),
    "huge coordinate": (coordinate(1e30), "return 70"),
    "scan of NaN": (all_nan, "000003.bin"),
    "folder for a scan": (folder_for_a_scan, "000003.bin"),
    "same number twice": (same_number_twice, "number 3"),
}

GAPS = {  # where the sensor got nothing back
    "NaN in a coordinate": coordinate(math.nan),
    "infinite coordinate": coordinate(-math.inf),
}

TIMES = {
    "short times.txt": (first_of("0", "0.1"), "2 lines"),
    "word in times.txt": (first_of("0", "0.1", "soon", "0.3", "0.4"), "line 3"),
    "NaN in times.txt": (first_of("0", "nan", "0.2", "0.3", "0.4"), "line 2"),
    "two numbers a line in times.txt": (first_of("0 0.1", "0.1", "0.2", "0.3", "0.4"), "line 1"),
    "time before 1970": (first_of("0", "0.1", "0.2", "-5", "0.4"), "scan 3"),
    "time in the future": (first_of("0", "0.1", "0.2", "0.3", "1e10"), "scan 4"),
}

POSES = {  # line 4 of poses.txt
    "11 numbers": "1 0 0 0 0 1 0 0 0 0 1",
    "13 numbers": "1 0 0 0 0 1 0 0 0 0 1 0 0",
    "word for a number": "1 0 0 here 0 1 0 0 0 0 1 0",
    "numbers run together": "1 0 0-0.5 0 1 0 0 0 0 1 0",
    "NaN in a rotation": "nan 0 0 0 0 1 0 0 0 0 1 0",
    "infinite position": "1 0 0 inf 0 1 0 0 0 0 1 0",
    "scaled rotation": "1.01 0 0 0 0 1.01 0 0 0 0 1.01 0",
    "reflected rotation": "1 0 0 0 0 1 0 0 0 0 -1 0",
    "rotation of zeros": "0 0 0 0 0 0 0 0 0 0 0 0",
    "pose 1e12 m away": "1 0 0 1e12 0 1 0 0 0 0 1 0",
    "pose 100 km up": "1 0 0 0 0 1 0 0 0 0 1 1e5",
}


def scan_cases(cases, drives):
    for number, (name, (spoil, says)) in enumerate({**SCANS, **TIMES}.items()):
        folder = drives.copy(f"scan_{number}")
        spoil(folder)
        # Whole scans before the bad one are not uploaded either.
        cases.refused(f"ingest, {name}", ["ingest", folder, *NEAR, "--session", f"scan{number}"],
                      "invalid_data", says)
        if name in SCANS:
            cases.refused(f"segment, {name}", ["segment", folder], "invalid_data", says)
            cases.refused(f"localize, {name}", ["localize", folder, "--scans", "odd"], "invalid_data", says,
                          is_stream=True)


def gap_cases(cases, drives):
    """A return that is none is dropped and counted, by every command."""
    for number, (name, spoil) in enumerate(GAPS.items()):
        folder = drives.copy(f"gap_{number}")
        spoil(folder)
        near = ["--max-range", "12"]
        for line in (["ingest", folder, *NEAR, "--session", f"gap{number}"], ["segment", folder],
                     ["localize", folder, *near], ["localize", folder, *near, "--perturb", "0.1,0.5", "--trials", "1"]):
            done = cases.accepted(f"{line[0]}, {name}", line)
            cases.report.equal(f"{line[0]}, {name}: dropped", done.get("dropped_returns"), 1)


def pose_cases(cases, drives):
    lines = drives.poses()
    for number, (name, line) in enumerate(POSES.items()):
        folder = drives.copy(f"pose_{number}")
        (folder / "poses.txt").write_text("\n".join([*lines[:3], line, *lines[4:]]) + "\n", encoding="ascii")
        for command in (["ingest", *NEAR], ["segment"], ["localize"]):
            cases.refused(f"{command[0]}, {name}", [command[0], folder, *command[1:]], "invalid_data",
                          "poses.txt: line 4")
    folder = drives.copy("short_poses")
    (folder / "poses.txt").write_text("\n".join(lines[:4]) + "\n", encoding="ascii")
    cases.refused("short poses.txt", ["ingest", folder], "invalid_data", "4 lines")
    (folder / "poses.txt").write_bytes(b"")
    cases.refused("empty poses.txt", ["ingest", folder], "invalid_data", "poses.txt")
    (folder / "poses.txt").write_bytes(bytes(range(256)) * 40)
    cases.refused("poses.txt of any bytes", ["ingest", folder], "invalid_data", "poses.txt: line 1")


def folder_cases(cases, drives):
    missing = {
        "no folder": (drives.folder / "nowhere", "nowhere"),
        "no velodyne": (drives.copy("no_velodyne"), "velodyne"),
        "no poses.txt": (drives.copy("no_poses"), "poses.txt"),
    }
    (drives.folder / "no_velodyne/velodyne").rename(drives.folder / "no_velodyne/scans")
    (drives.folder / "no_poses/poses.txt").unlink()
    empty_folder = drives.folder / "empty"
    (empty_folder / "velodyne").mkdir(parents=True)
    for command in ("ingest", "segment", "localize"):
        for name, (folder, says) in missing.items():
            cases.refused(f"{command}, {name}", [command, folder], "not_found", says)
        cases.refused(f"{command}, no scan in the folder", [command, empty_folder], "invalid_data", "velodyne")
        cases.refused(f"{command}, a file for a folder", [command, drives.good / "poses.txt"], "not_found",
                      "poses.txt")


def permission_cases(cases, drives):
    for name in ("velodyne/000003.bin", "poses.txt", "times.txt", "velodyne"):
        folder = drives.copy("closed_" + name.replace("/", "_"))
        closed = folder / name
        mode = closed.stat().st_mode
        closed.chmod(0)
        cases.forbidden(f"unreadable {name}", ["ingest", folder, *NEAR], name)
        closed.chmod(mode)
    broken_localization(cases, drives)


def broken_localization(cases, drives):
    """What was found before a failure is kept."""
    folder, out = drives.copy("closed_scan"), drives.folder / "broken"
    out.mkdir(mode=0o777)
    out.chmod(0o777)
    (folder / "velodyne/000003.bin").chmod(0)
    for name, flags in (("tracked", []), ("relocalized", ["--relocalize"])):
        file = out / f"{name}.csv"
        cases.forbidden(f"localize, a scan that cannot be read, {name}", ["localize", folder, *flags, "--output", file],
                        f"{file} has what came before, 3 lines: ", is_stream=True)
        if cases.unprivileged is not None:
            scans = [line.split(",")[0] for line in file.read_text(encoding="ascii").splitlines()]
            cases.report.equal(f"localize, {name}: what came before", scans, ["scan", "0", "1", "2"])


def label_cases(cases, drives):
    for name, size in (("too few labels", -4), ("too many labels", 4), ("half a label", -2)):
        folder = drives.copy(name.replace(" ", "_"))
        label = folder / "labels/000002.label"
        data = label.read_bytes()
        label.write_bytes(data[:size] if size < 0 else data + b"\0" * size)
        cases.refused(f"segment, {name}", ["segment", folder], "invalid_data", "000002.label")


POSITIONS = {  # line 2 of a file of positions
    "four numbers": "1 0 0 0.5",
    "word for a number": "1 0 0 up 0.5",
    "NaN": "1 0 nan 0 0.5",
    "negative radius": "1 0 0 0 -0.5",
    "radius of nothing": "1 0 0 0 0",
    "negative scan": "-1 0 0 0 0.5",
    "scan that there is not": "4711 0 0 0 0.5",
    "scan twice": "0 0 0 0 0.5",
}


def position_cases(cases, drives):
    positions = drives.folder / "positions.txt"
    command = ["ingest", drives.good, *NEAR, "--session", "positions", "--positions", positions]
    for name, line in POSITIONS.items():
        positions.write_text(f"0 1 2 3 0.5\n{line}\n", encoding="ascii")
        cases.refused(f"positions, {name}", command, "invalid_data", "positions.txt: line 2")
    positions.write_bytes(b"")
    cases.refused("positions, none in it", command, "invalid_data", "positions.txt")
    positions.unlink()
    cases.refused("positions, no file", command, "not_found", "positions.txt")


def run(cases, source, work):
    drives = Drives(source, work)
    cases.run("ingest", drives.good, *NEAR)
    for group in (scan_cases, gap_cases, pose_cases, folder_cases, permission_cases, label_cases, position_cases):
        group(cases, drives)
