"""Data directories and disks that the daemon cannot use, and databases that are damaged."""

import contextlib
import os
import pathlib
import re
import shutil
import sqlite3
import subprocess
import time

from harness import NEAR, SMALL, Daemon, Drives


def refuses_to_start(cases, name, data, flags, code, says, **popen):
    daemon = Daemon(cases.bin_dir, data, *flags, **popen)
    exit_code = daemon.stop()
    cases.report.check(f"{name}: does not listen", daemon.server is None, daemon.server)
    cases.report.equal(f"{name}: exit code", exit_code, code)
    cases.report.check(f"{name}: message", re.search(says, daemon.err) is not None, daemon.err)


def start_cases(cases, work, data):
    before = cases.state()
    refuses_to_start(cases, "a second daemon", data, [], 4, r"conflict: .*in use by process \d+")
    cases.report.equal("a second daemon: the atlas", cases.state(), before)
    folder = pathlib.Path(work)
    (folder / "file").write_text("notes", encoding="ascii")
    refuses_to_start(cases, "a file for a data directory", folder / "file", [], 2,
                     "invalid_argument: data directory .*file: .*expected a directory")
    refuses_to_start(cases, "a data directory below a file", folder / "file/data", [], 2,
                     "invalid_argument: data directory .*file/data: .*expected a directory")
    cases.report.equal("the file", (folder / "file").read_text(encoding="ascii"), "notes")
    (folder / "notes").mkdir()
    (folder / "notes/todo.txt").write_text("notes", encoding="ascii")
    refuses_to_start(cases, "a directory of other files", folder / "notes", [], 2, "todo.txt")
    cases.report.equal("the other files", os.listdir(folder / "notes"), ["todo.txt"])
    (folder / "closed").mkdir(mode=0o555)
    if cases.unprivileged is not None:
        refuses_to_start(cases, "a read-only data directory", folder / "closed", [], 1,
                         "permission_denied: .*closed", **cases.unprivileged)
    for flags in (["--listen", "0.0.0.0:0"], ["--listen", "nowhere"], ["--cell-size", "x"], ["--cell-size", "-1"],
                  ["--segments", "3"], ["--segment-height", "0"], ["--preset", "loose"], ["--workers", "-1"],
                  ["--bogus"], ["more"]):
        refuses_to_start(cases, f"atlasd {flags}", folder / "never", flags, 2, "invalid_argument: ")
    cases.report.check("no atlas of refused flags", not (folder / "never").exists())


def other_flags_cases(cases, drives, work):
    data = work + "/fixed"
    with Daemon(cases.bin_dir, data, *SMALL) as daemon:
        before = type(cases)(cases.report, cases.bin_dir, daemon.server)
        before.run("ingest", drives.good, *NEAR)
        state = before.state()
    for flags in (["--cell-size", "0.1"], ["--segments", "16"], ["--segment-height", "0.5"]):
        refuses_to_start(cases, f"reopened with {flags}", data, flags, 6, "fixed when an atlas is made")
    with Daemon(cases.bin_dir, data, *SMALL, "--segments", "8") as daemon:
        after = type(cases)(cases.report, cases.bin_dir, daemon.server)
        cases.report.equal("reopened with the same flags", after.state(), state)


def made_atlas(cases, drives, data, *flags):
    with Daemon(cases.bin_dir, data, *SMALL, *flags) as daemon:
        client = type(cases)(cases.report, cases.bin_dir, daemon.server)
        client.run("ingest", drives.good, *NEAR)
        client.run("wait")
    return pathlib.Path(data) / "atlas.db"


def damage(database, statement):
    with contextlib.closing(sqlite3.connect(database)) as connection, connection:
        connection.execute(statement)


def database_cases(cases, drives, work):
    whole = made_atlas(cases, drives, work + "/whole")
    size = whole.stat().st_size

    def copy(name):
        shutil.copytree(whole.parent, f"{work}/{name}")
        return pathlib.Path(work, name, "atlas.db")

    spoiled = copy("garbage")
    spoiled.write_bytes(b"not a database" * 1000)
    refuses_to_start(cases, "a database of garbage", spoiled.parent, [], 6, "invalid_data: .*atlas.db")
    spoiled = copy("empty_database")
    spoiled.write_bytes(b"")
    refuses_to_start(cases, "an empty database", spoiled.parent, [], 6, "invalid_data: .*atlas.db")
    spoiled = copy("truncated")
    os.truncate(spoiled, size // 2)
    refuses_to_start(cases, "a database cut in half", spoiled.parent, [], 6, "invalid_data: .*atlas.db")
    spoiled = copy("meta")
    damage(spoiled, "UPDATE meta SET epoch = epoch + 1")
    refuses_to_start(cases, "a damaged identity", spoiled.parent, [], 6, "invalid_data: .*meta")
    spoiled = copy("newer")
    damage(spoiled, "PRAGMA user_version = 99")
    refuses_to_start(cases, "a newer schema", spoiled.parent, [], 6, "unsupported: .*schema")
    shutil.rmtree(copy("folder").parent)
    (pathlib.Path(work) / "folder/atlas.db").mkdir(parents=True)
    refuses_to_start(cases, "a folder for a database", work + "/folder", [], 1, "atlas.db")


def damaged_row_cases(cases, drives, work):
    """Damage is found when it is met; all else is served."""
    database = made_atlas(cases, drives, work + "/rows")
    damage(database, "UPDATE keyframes SET blob = zeroblob(length(blob)) WHERE sequence = 2")
    moved = pathlib.Path(work) / "moved.txt"
    moved.write_text("vehicle good 3 1 0 0 4 0 1 0 -1.6 0 0 1 1.8\n", encoding="ascii")
    with Daemon(cases.bin_dir, database.parent) as daemon:
        client = type(cases)(cases.report, cases.bin_dir, daemon.server)
        done = client.call("verify", "--json")
        cases.report.equal("verify, a damaged keyframe: exit code", done.returncode, 6)
        cases.report.check("verify, a damaged keyframe: counts", '"damaged":1' in done.stdout, done.stdout)
        client.typed("verify, a damaged keyframe", done.stderr, "invalid_data", "1 damaged")
        cases.report.check("a damaged keyframe: still served", client.run("point", "0", "-1.6")["layers"] != [])
        client.run("poses", "apply", moved)  # its neighbours cannot be fused again
        for command in ("wait", "digest"):
            done = client.call(command, "--json")
            cases.report.equal(f"{command}, a damaged keyframe: exit code", done.returncode, 6)
            client.typed(f"{command}, a damaged keyframe", done.stderr, "invalid_data", "keyframe vehicle/good/2")
        status = client.run("status")
        cases.report.check("a damaged keyframe: dirty tiles stay", status["dirty_tiles"] > 0)
        cases.report.equal("a damaged keyframe: they are counted", status["damaged_tiles"],
                           status["dirty_tiles"])


@contextlib.contextmanager
def small_disk(folder, flags):
    """A file system of its own; None where it may not be made."""
    pathlib.Path(folder).mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", flags, "tmpfs", folder], stderr=subprocess.PIPE,
                             check=False).returncode == 0 if shutil.which("mount") else False
    try:
        yield folder if mounted else None
    finally:
        if mounted:
            subprocess.run(["umount", folder], check=True)


def fill(file):
    with file.open("wb", buffering=0) as ballast, contextlib.suppress(OSError):
        while ballast.write(b"\0" * 4096):
            pass


def in_time(condition):
    """Whether it holds within half a minute."""
    deadline = time.monotonic() + 30
    while time.monotonic() < deadline:
        if condition():
            return True
    return False


def ready_again(daemon):
    return in_time(lambda: daemon.is_ready()[0])


def full_disk_case(cases, drives, work):
    with small_disk(work + "/full", "size=8m") as disk:
        if disk is None:
            cases.report.skip("a full disk", "a small file system cannot be mounted here")
            return
        with Daemon(cases.bin_dir, disk + "/atlas", *SMALL, "--disk-floor-mib", "0", "--http", "127.0.0.1:0") as daemon:
            client = type(cases)(cases.report, cases.bin_dir, daemon.server)
            cases.report.equal("a disk with room: ready", daemon.is_ready(), (True, "ok\n"))
            client.run("ingest", drives.good, *NEAR, "--range", "0:2")
            before = client.state()
            ballast = pathlib.Path(disk) / "ballast"
            fill(ballast)
            far = ["ingest", drives.good, "--every", "0", "--max-range", "40", "--session", "far"]
            client.refused("ingest on a full disk", far, "resource_exhausted", "vehicle/far/")
            is_ready, why = daemon.is_ready()
            cases.report.check("a full disk: not ready", not is_ready and "full" in why, why)
            refuses_to_start(cases, "an atlas on a full disk", disk + "/second", SMALL, 1, "resource_exhausted: ")
            cases.report.check("an atlas on a full disk: nothing half-made",
                               not list(pathlib.Path(disk, "second").glob("atlas.db*")))
            cases.report.equal("a full disk: the atlas", client.state(), before)
            tiles = ["query", "--center", "0,0", "--radius", "50", "-o", pathlib.Path(disk) / "tiles"]
            client.refused("query onto a full disk", tiles, "resource_exhausted", "tiles", is_stream=True)
            client.refused("render onto a full disk", ["render", "-o", pathlib.Path(disk) / "map.png"],
                           "resource_exhausted", "map.png")
            ballast.unlink()
            done = client.accepted("a disk with room again", ["ingest", drives.good, *NEAR])
            cases.report.equal("a disk with room again: acked", done.get("acked"), 5)
            client.run("wait")
            cases.report.check("a disk with room again: ready again", ready_again(daemon))
            cases.report.equal("a disk with room again: verify", client.run("verify", "--rebuild")["damaged"], 0)


def disk_floor_case(cases, drives, work):
    with small_disk(work + "/floor", "size=16m") as disk:
        if disk is None:
            cases.report.skip("a disk below its floor", "a small file system cannot be mounted here")
            return
        with Daemon(cases.bin_dir, disk + "/atlas", *SMALL, "--disk-floor-mib", "4", "--http", "127.0.0.1:0") as daemon:
            client = type(cases)(cases.report, cases.bin_dir, daemon.server)
            client.run("ingest", drives.good, *NEAR, "--range", "0:2")
            client.run("wait")
            ballast = pathlib.Path(disk) / "ballast"
            with ballast.open("wb") as file:
                file.write(b"\0" * (os.statvfs(disk).f_bavail * os.statvfs(disk).f_frsize - (3 << 20)))
            # The room on the disk is asked for once a second.
            cases.report.check("below the floor: status", in_time(lambda: client.run("status")["refusing"] == "disk_floor"))
            more = ["ingest", drives.good, *NEAR]
            client.refused("ingest below the floor", more, "resource_exhausted", "retention.disk_floor_mib",
                           reason="disk_floor")
            is_ready, why = daemon.is_ready()
            cases.report.check("below the floor: not ready", not is_ready and "disk_floor" in why, why)
            cases.report.equal("below the floor: what is there is a duplicate",
                               client.run("ingest", drives.good, *NEAR, "--range", "0:2")["duplicates"], 2)
            client.run("session", "retract", "vehicle/good")
            client.run("session", "restore", "vehicle/good")
            ballast.unlink()
            cases.report.check("above the floor again: uploads", in_time(lambda: client.call(*more).returncode == 0))
            client.run("wait")
            cases.report.check("above the floor again: ready", ready_again(daemon))
            cases.report.equal("above the floor again: verify", client.run("verify", "--rebuild")["damaged"], 0)


def read_only_disk_case(cases, drives, work):
    with small_disk(work + "/read_only", "size=16m") as disk:
        if disk is None:
            cases.report.skip("a read-only disk", "a file system cannot be mounted here")
            return
        made_atlas(cases, drives, disk + "/atlas", "--disk-floor-mib", "0")
        subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
        refuses_to_start(cases, "an atlas on a read-only disk", disk + "/atlas", [], 1, "permission_denied: ")
        refuses_to_start(cases, "a new atlas on a read-only disk", disk + "/new", SMALL, 1, "permission_denied: ")
        subprocess.run(["mount", "-o", "remount,rw", disk], check=True)
        with Daemon(cases.bin_dir, disk + "/atlas") as daemon:
            client = type(cases)(cases.report, cases.bin_dir, daemon.server)
            cases.report.equal("a disk writable again", client.run("verify")["damaged"], 0)


def run(cases, source, work):
    drives = Drives(source, work + "/drives")
    cases.run("ingest", drives.good, *NEAR)
    start_cases(cases, work, pathlib.Path(work).parent / "atlas")
    other_flags_cases(cases, drives, work)
    database_cases(cases, drives, work)
    damaged_row_cases(cases, drives, work)
    full_disk_case(cases, drives, work)
    disk_floor_case(cases, drives, work)
    read_only_disk_case(cases, drives, work)
