#!/usr/bin/python3
"""Bad input through the real command line: refused with a typed error, nothing half-written, and the daemon
serves on. Usage: bad_input_test.py BIN_DIR DRIVE GROUP; DRIVE is a simulated street with labels."""

import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))

import atlas_cases
import backup_cases
import daemon_cases
import drive_cases
import usage_cases
from harness import SMALL, Cases, Daemon, Report

GROUPS = {"atlas": atlas_cases, "backups": backup_cases, "daemon": daemon_cases, "drives": drive_cases, "usage": usage_cases}


def main():
    bin_dir, source, group = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
    report = Report()
    with tempfile.TemporaryDirectory() as work:
        pathlib.Path(work).chmod(0o755)  # commands that run as nobody reach it
        with Daemon(bin_dir, work + "/atlas", *SMALL) as daemon:
            GROUPS[group].run(Cases(report, bin_dir, daemon.server), source, work + "/work")
        report.equal("the daemon's exit code after SIGTERM", daemon.process.returncode, 0)
    print(f"{report.checks} checks, {report.failed} failed")
    return 1 if report.failed else 0


if __name__ == "__main__":
    sys.exit(main())
