#!/usr/bin/python3
"""Atlases of earlier schemas and profiles under today's daemon: they open, verify, and vehicles go on in them.
Usage: upgrade_test.py BIN_DIR DRIVE GOLDEN_DIR; DRIVE is a simulated street."""

import pathlib
import sqlite3
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))

from harness import NEAR, Cases, Daemon, Drives, Report

PLACE = ("-4.5", "12")  # where day/1 was moved to
EARLIER = ("store_v1_first", "store_v2", "store_v3_starts", "store_v4", "store_v5")
READABLE = ("store_v5",)  # whose rows are today's


def make(golden, name, data):
    data.mkdir()
    database = sqlite3.connect(data / "atlas.db")
    database.executescript((golden / f"{name}.sql").read_text(encoding="ascii"))
    database.close()


def point(bin_dir, data):
    return subprocess.run([bin_dir / "atlas", "point", *PLACE, "--atlas", data / "atlas.db", "--json"],
                          capture_output=True, text=True, check=False)


def vehicle_cases(cases, name, drive):
    ingested = cases.run("ingest", drive, *NEAR)
    cases.report.equal(f"{name}: acknowledged", (ingested["acked"], ingested["duplicates"]), (5, 0))
    again = cases.run("ingest", drive, *NEAR)
    cases.report.equal(f"{name}: sent again", (again["acked"], again["duplicates"]), (5, 5))
    cases.run("wait")
    driven = cases.run("localize", drive, "--perturb", "0.2,1", "--max-range", "12")
    cases.report.equal(f"{name}: scans not localized", driven["failures"], 0)
    cases.report.check(f"{name}: error", driven["translation_rmse_m"] < 0.1, driven)


def upgrade_cases(report, bin_dir, golden, name, drive, work):
    data = pathlib.Path(work) / name
    make(golden, name, data)
    before = point(bin_dir, data)
    report.equal(f"{name}: without a daemon", before.returncode, 0 if name in READABLE else 1)
    says = '"layers"' if name in READABLE else "open it once with atlasd"
    report.check(f"{name}: without a daemon, says", says in before.stdout + before.stderr, before.stderr)
    with Daemon(bin_dir, data) as daemon:
        cases = Cases(report, bin_dir, daemon.server)
        cases.run("wait")
        sound = cases.run("verify", "--rebuild")
        report.equal(f"{name}: verified", (sound["damaged"], sound["mismatched"]), (0, 0))
        report.check(f"{name}: tiles", cases.run("status")["tiles"] > 10, cases.run("status"))
        report.check(f"{name}: the map", cases.run("point", *PLACE)["layers"], cases.run("point", *PLACE))
        events = [(event["kind"], event["author"], event["detail"]) for event in cases.run("log")["events"]]
        report.equal(f"{name}: event", [event for event in events if event[0] == "upgraded"],
                     [("upgraded", "atlasd", f"from version {name[7]}")])
        vehicle_cases(cases, name, drive)
        report.equal(f"{name}: exit code", daemon.stop(), 0)
    shown = point(bin_dir, data)
    report.check(f"{name}: without a daemon, upgraded", shown.returncode == 0 and '"layers":[{' in
                 shown.stdout.replace(" ", ""), shown.stdout + shown.stderr)


def main():
    bin_dir, source, golden = map(pathlib.Path, sys.argv[1:4])
    report = Report()
    with tempfile.TemporaryDirectory() as work:
        drive = Drives(source, work + "/drives").good
        for name in EARLIER:
            upgrade_cases(report, bin_dir, golden, name, drive, work)
    print(f"{report.checks} checks, {report.failed} failed")
    return 1 if report.failed else 0


if __name__ == "__main__":
    sys.exit(main())
