#!/usr/bin/python3
"""What deploy/valgrind.sh runs once all is built."""

import argparse
import pathlib
import re
import subprocess
import sys
import tempfile

from bench_daemon import Atlas

# The daemon's memory comes from jemalloc: valgrind takes the place of that, as it does of the system's.
VALGRIND = ("valgrind", "--soname-synonyms=somalloc=*jemalloc*", "--leak-check=full", "--show-leak-kinds=definite",
            "--errors-for-leak-kinds=definite", "--error-exitcode=99", "--num-callers=30")
ONE_WORKER = ("--workers", "1")  # valgrind runs one thread at a time
POSES = "".join(f"1 0 0 {x} 0 1 0 0 0 0 1 1.8\n" for x in range(2))


def life_of_a_daemon(bin_dir, report):
    """Its exit code."""
    with tempfile.TemporaryDirectory() as work:
        drive, poses = pathlib.Path(work) / "drive", pathlib.Path(work) / "poses.txt"
        poses.write_text(POSES, encoding="ascii")
        subprocess.run([bin_dir / "atlas", "simulate", "city", "--trajectory", poses, "-o", drive], check=True,
                       stdout=subprocess.DEVNULL)
        with Atlas(bin_dir, *ONE_WORKER, under=(*VALGRIND, f"--log-file={report}")) as atlas:
            atlas.run("ingest", drive)
            atlas.run("wait")
            if not atlas.run("point", 3, 0)["layers"]:
                sys.exit("valgrind: there is no map where the drive was")
            return atlas.stop()


def allocations(report):
    found = re.search(r"total heap usage: ([\d,]+) allocs", report)
    return int(found.group(1).replace(",", "")) if found else 0


def main():
    parser = argparse.ArgumentParser(prog="deploy/valgrind.sh", description=__doc__)
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    args = parser.parse_args()
    with tempfile.NamedTemporaryFile("r", encoding="utf-8") as file:
        code = life_of_a_daemon(args.bin, file.name)
        report = file.read()
    if code or allocations(report) < 10_000:  # fewer: it does not see what the daemon allocates
        sys.exit(f"{report}\nvalgrind: exit code {code}, {allocations(report)} allocations seen")
    print(f"valgrind: no error, nothing lost in {allocations(report)} allocations")


if __name__ == "__main__":
    main()
