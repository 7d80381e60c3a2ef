#!/usr/bin/python3
"""`atlas-merge run --output`: a new atlas, and all others as they were.

Usage: merge_output_test.py BIN_DIR DRIVES make|refuse."""

import fcntl
import hashlib
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "support"))
from harness import Daemon  # noqa: E402
from merge_harness import COARSE, PATIENCE_S, Merges, Watched, run_group  # noqa: E402


def hash_of(file):
    return hashlib.sha256(file.read_bytes()).hexdigest()


def left(folder):
    """What lies there, hidden files too."""
    return sorted(path.name for path in folder.iterdir())


def look_into(merges, file):
    """The new atlas as a daemon has it that goes on with it: sessions by vehicle, and its digest."""
    data = file.parent / f"{file.stem}.data"
    data.mkdir()
    merges.run("restore", file, "--to", data / "atlas.db")
    with Daemon(merges.bin_dir, data) as daemon:
        there = Merges(merges.report, merges.bin_dir, daemon.server, merges.drives)
        merges.report.equal(f"{file.name}: its tiles are those of its keyframes", there.run("verify", "--rebuild")["damaged"], 0)
        return there.states(), there.run("digest")["digest"]


def from_nothing_cases(merges, other, work):
    """Of two daemons that go on as they were, and of nothing else."""
    report, made = merges.report, work / "made"
    made.mkdir()
    before = merges.state(), other.state()
    done = merges.merge("run", "--from", merges.server, "--from", other.server, "--output", made / "new.db", "--json",
                        server=False)
    report.equal(f"a new atlas: exit code ({done.stderr})", done.returncode, 0)
    told = json.loads(done.stdout)
    report.equal("a new atlas: what is told of it", set(told["output"]), {"file", "bytes", "keyframes", "tiles", "digest"})
    report.equal("a new atlas: nothing beside it", left(made), ["new.db"])
    report.equal("a new atlas: its size", told["output"]["bytes"], (made / "new.db").stat().st_size)
    states, digest = look_into(merges, made / "new.db")
    report.equal("a new atlas: who is in its map", states, {"first": "live", "second": "live"})
    report.equal("a new atlas: its digest", digest, told["output"]["digest"])
    report.equal("a new atlas: where it is from", (merges.state(), other.state()), before)


def from_copy_cases(merges, other, work):
    """Of a backup and of a daemon: what is in the map of the backup stays there."""
    report, made = merges.report, work / "made"
    merges.run("backup", "monday")
    base = work / "backups/monday"
    content = hash_of(base)
    file = made / "copied.db"
    done = merges.merge("run", "--atlas", base, "--from", other.server, "--output", file, server=False)
    report.equal(f"of a copy: exit code ({done.stderr})", done.returncode, 0)
    report.check("of a copy: for people", f"{file}: " in done.stdout and "once a daemon serves the new file" in done.stdout, done.stdout)
    report.equal("of a copy: the backup", hash_of(base), content)
    states, _ = look_into(merges, file)
    report.equal("of a copy: who is in its map", states, {"first": "live", "second": "live"})
    dry = merges.merged("of a copy, a dry run", "--atlas", base, "--from", other.server, server=False)
    report.equal("of a copy, a dry run", (dry["published"], dry["applied"]), (1, False))


def interrupted_cases(merges, other, work):
    """Ended at any step, there is no file and nothing beside it, nor among temporary files."""
    report, made = merges.report, work / "ended"
    made.mkdir()
    (work / "temporary").mkdir()
    os.environ["TMPDIR"] = str(work / "temporary")
    for step in ("bringing", "submaps", "search"):
        for number in (signal.SIGINT, signal.SIGTERM):
            watched = Watched(merges, "run", "--from", merges.server, "--from", other.server, "--output", made / "new.db")
            report.check(f"signal {number} while {step}: it came to that", watched.wait_for(step), watched.shown)
            watched.process.send_signal(number)
            report.equal(f"signal {number} while {step}: its end", watched.end()[0], -number)
            report.equal(f"signal {number} while {step}: what is left", left(made) + left(work / "temporary"), [])


def killed_cases(merges, work):
    """A SIGKILL leaves a hidden folder: who makes the same file next removes it, unless somebody is in it, or may be
    about to be, as it is new."""
    report, made = merges.report, work / "killed"
    made.mkdir()
    flags = ("run", "--from", merges.server, "--output", made / "new.db")
    watched = Watched(merges, *flags)
    report.check("killed: it came to that", watched.wait_for("submaps"), watched.shown)
    watched.process.kill()
    watched.end()
    report.equal("killed: what is left", len(left(made)), 1)
    other = made / ".new.db.merging-others"
    other.mkdir()
    with open(other / "lock", "w", encoding="ascii") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        for folder in made.glob(".new.db.merging-*"):
            os.utime(folder / "lock", (0, 0))
        done = merges.merge(*flags, "--json", server=False)
        report.equal(f"once more: exit code ({done.stderr})", done.returncode, 0)
        report.equal("once more: what is left", left(made), [other.name, "new.db"])


def make(report, bin_dir, drives, work):
    (work / "backups").mkdir()
    with Daemon(bin_dir, work / "atlas", *COARSE, "--backup-folder", work / "backups") as daemon, \
            Daemon(bin_dir, work / "other", *COARSE) as source:
        merges = Merges(report, bin_dir, daemon.server, drives)
        other = Merges(report, bin_dir, source.server, drives)
        merges.ingest("first")
        other.ingest("second")
        for one in (merges, other):
            one.run("wait")
        from_nothing_cases(merges, other, work)
        from_copy_cases(merges, other, work)
        interrupted_cases(merges, other, work)
        killed_cases(merges, work)


def alone_case(merges, work):
    """A program without a daemon beside it, or on the PATH."""
    alone = work / "alone"
    alone.mkdir(mode=0o755)
    shutil.copy(merges.bin_dir / "atlas-merge", alone)
    done = subprocess.run([alone / "atlas-merge", "run", "--from", merges.server, "--output", work / "new.db", "--json"],
                          capture_output=True, text=True, timeout=PATIENCE_S, check=False,
                          env={**os.environ, "PATH": "/usr/bin:/bin"})
    merges.report.equal("no daemon beside it: exit code", done.returncode, 3)
    merges.typed("no daemon beside it", done.stderr.splitlines()[-1], "not_found", "atlasd")
    merges.report.check("no daemon beside it: nothing is left", not [name for name in left(work) if "new.db" in name])


def refuse(report, bin_dir, drives, work):
    with Daemon(bin_dir, work / "atlas", *COARSE) as daemon:
        merges = Merges(report, bin_dir, daemon.server, drives)
        merges.staged("first")
        there = work / "there.db"
        there.write_text("mine")
        source = ("--from", merges.server)
        for name, flags, code, says in (
                ("a file that is there", [*source, "--output", there], "conflict", "there.db"),
                ("in no folder", [*source, "--output", work / "none/new.db"], "not_found", "none"),
                ("of nothing", ["--output", work / "new.db"], "invalid_argument", "--from"),
                ("a dry run", [*source, "--output", work / "new.db", "--dry-run"], "invalid_argument", "--dry-run"),
                ("of an atlas in use", ["--atlas", work / "atlas/atlas.db", "--output", work / "new.db"],
                 "invalid_argument", "in use"),
                ("of no atlas", ["--atlas", there, "--output", work / "new.db"], "invalid_data", "there.db"),
                ("an unknown session", [*source, "--output", work / "new.db", "--session", "nobody/day"], "not_found",
                 "nobody/day")):
            merges.merge_refused(name, ["run", *flags], code, says, server=False)
        merges.report.equal("refused: what was there", there.read_text(), "mine")
        merges.report.equal("refused: nothing is left", left(work), ["atlas", "there.db"])
        alone_case(merges, work)
        if merges.unprivileged is None:
            report.skip("where nobody may write", "nobody may not run what is built")
        else:
            (work / "locked").mkdir(mode=0o755)
            merges.merge_refused("where nobody may write", ["run", *source, "--output", work / "locked/new.db"],
                                 "permission_denied", "locked", server=False, **merges.unprivileged)


GROUPS = {"make": make, "refuse": refuse}


if __name__ == "__main__":
    sys.exit(run_group(GROUPS))
