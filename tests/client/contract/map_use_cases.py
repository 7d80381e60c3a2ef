"""What `localize` and `plan` say where the answer is not the one that was hoped for, and the files that they write."""

import csv
import json
import pathlib


def relocalized_cases(cases, work, drive):
    """A line a scan, found or not; its numbers are those of the stream."""
    file = pathlib.Path(work) / "relocalized.csv"
    done = cases.call("localize", drive, "--relocalize", "--prior-radius", "5", "--output", file, "--json")
    *scans, summary = [json.loads(line) for line in done.stdout.splitlines()]
    with open(file, newline="", encoding="ascii") as text:
        rows = list(csv.DictReader(text))
    cases.report.equal("relocalized.csv: scans", [int(row["scan"]) for row in rows], [scan["scan"] for scan in scans])
    for row, scan in zip(rows, scans):
        cases.report.equal("relocalized.csv: found", row["health"], scan["health"])
        cases.report.equal("relocalized.csv: a pose where it was", row["x_m"] != "", scan["pose"] is not None)
        cases.report.check("relocalized.csv: margin", abs(float(row["margin"]) - scan["margin"]) < 1e-3, row)
        cases.report.check("relocalized.csv: error", "error_m" not in scan or
                           abs(float(row["error_m"]) - scan["error_m"]) < 1e-4, row)
    cases.report.equal("relocalized.csv: the summary's", sum(row["health"] == "good" for row in rows),
                       summary["right"] + summary["wrong"])


def damaged_scan_cases(cases, work, drives):
    """A scan that cannot be read is one that was not found: the others are, all is written, and the end is an error."""
    folder, file = drives.copy("one_cut"), pathlib.Path(work) / "one_cut.csv"
    scan = folder / "velodyne/000002.bin"
    scan.write_bytes(scan.read_bytes()[:-3])
    done = cases.call("localize", folder, "--max-range", "5", "--relocalize", "--output", file, "--json")
    cases.report.equal("a cut scan: exit code", done.returncode, 6)
    cases.typed("a cut scan", done.stderr, "invalid_data", "000002.bin")
    with open(file, newline="", encoding="ascii") as text:
        rows = list(csv.DictReader(text))
    cases.report.equal("a cut scan: a line a scan", [int(row["scan"]) for row in rows], list(range(5)))
    cases.report.equal("a cut scan: its line", (rows[2]["health"], rows[2]["x_m"], rows[2]["places"]), ("lost", "", "0"))


def lost_cases(cases, work, drives):
    """Where no scan is localized that is the answer: all is written, and stderr says what it may mean."""
    astray = drives.copy("astray")
    poses = [line.split() for line in drives.poses()]
    for pose in poses:
        pose[3] = str(float(pose[3]) + 1000.0)
    (astray / "poses.txt").write_text("".join(" ".join(pose) + "\n" for pose in poses), encoding="ascii")
    files = [pathlib.Path(work) / f"astray.{ending}" for ending in ("csv", "svg")]
    line = ["localize", astray, "--max-range", "5", "--output", files[0], "--plot", files[1]]
    for name, args, says in (("tracked", line, "--relocalize"),
                             ("single shots", [*line[:4], "--perturb", "1,1", "--trials", "2"], "--perturb"),
                             ("relocalized", [*line[:4], "--relocalize"], "of another place")):
        done = cases.call(*args, "--json")
        summary = json.loads(done.stdout.splitlines()[-1])
        cases.report.equal(f"lost, {name}: exit code", done.returncode, 0)
        cases.report.equal(f"lost, {name}: the last line", summary["type"], "summary")
        cases.report.check(f"lost, {name}: a note", "note: none of 5 scans" in done.stderr and says in done.stderr,
                           done.stderr)
        plain = cases.call(*args)
        cases.report.check(f"lost, {name}: in words", plain.returncode == 0 and "scans" in plain.stdout and
                           "none of 5 scans" in plain.stderr, plain)
    for file in files:
        cases.report.check(f"lost: {file.name} is written", file.exists())


def route_cases(cases, work):
    """What `plan` says of ends that it moved, and what `render` makes of routes of other maps."""
    line = ["plan", "--from", "0,-1.6,1.5", "--to", "4,-1.6,0"]
    files = [pathlib.Path(work) / f"route.{ending}" for ending in ("geojson", "csv")]
    for file in files:
        found = cases.run(*line, "--output", file)
    cases.report.check("plan: where the start stands", abs(found["start"]["above_m"] + 1.5) < 0.3 and
                       found["start"]["asked"] == [0, -1.6, 1.5] and found["start"]["layers"] > 0, found["start"])
    cases.report.check("plan: in words", "start moved" in cases.call(*line).stdout)
    cases.report.check("route.csv: a table", files[1].read_text(encoding="ascii").startswith("x_m,y_m,z_m,"))
    route = json.loads(files[0].read_text(encoding="ascii"))
    cases.report.equal("route.geojson: the start", route["properties"]["start"], found["start"])
    count = len(route["geometry"]["coordinates"])

    def drawn(name, change, exit_code, says, **expected):
        other, picture = json.loads(json.dumps(route)), pathlib.Path(work) / "routed.png"
        change(other, other["geometry"]["coordinates"])
        files[0].write_text(json.dumps(other), encoding="ascii")
        picture.unlink(missing_ok=True)
        done = cases.call("render", "-o", picture, "--path", files[0], "--json")
        cases.report.equal(f"render, {name}: exit code", done.returncode, exit_code)
        cases.report.check(f"render, {name}: stderr", says in done.stderr if says else not done.stderr, done.stderr)
        cases.report.equal(f"render, {name}: a picture", picture.exists(), exit_code == 0)
        if expected:
            cases.report.equal(f"render, {name}: the route", json.loads(done.stdout)["route"], expected)

    def shift(axis, metres):
        return lambda _, points: [point.__setitem__(axis, point[axis] + metres) for point in points]

    of_all = {"points": count, "on_tiles": count, "on_surfaces": count, "same_atlas": True}
    drawn("its own route", lambda *_: None, 0, "", **of_all)
    drawn("of another atlas", lambda other, _: other["atlas"].update(id="00"), 0, "in another atlas",
          **{**of_all, "same_atlas": False})
    drawn("far above the map", shift(2, 40.0), 0, "no surface within", **{**of_all, "on_surfaces": 0})
    drawn("of another frame", shift(0, 5000.0), 4, "none of its")
    drawn("of nobody knows what", lambda other, _: other.pop("atlas"), 0, "", **{**of_all, "same_atlas": None})
    cases.run("render", "-o", f"{work}/routed.png", "--path", files[1])


def run(cases, drives, work):
    relocalized_cases(cases, work, drives.good)
    damaged_scan_cases(cases, work, drives)
    lost_cases(cases, work, drives)
    route_cases(cases, work)
