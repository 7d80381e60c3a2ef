#!/usr/bin/python3
"""`atlas-merge run` as scripts and people know it: what it prints, what it leaves, how it ends.

Usage: merge_test.py BIN_DIR DRIVES tell|change|bring."""

import hashlib
import json
import pathlib
import signal
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "support"))
from harness import EXIT, Daemon  # noqa: E402
from merge_harness import COARSE, NEAR, Merges, Watched, run_group  # noqa: E402

KEYS = {"revision", "sessions", "left_out", "closures", "rejected", "closure_rms_m", "closure_rms_deg",
        "keyframes_moved", "published", "tiles", "applied", "rejected_closures", "pairs", "tile_size_m", "fused_tiles"}
APPLIED_KEYS = KEYS | {"batch", "updated", "tiles_marked", "revision_after"}
SESSION_KEYS = {"vehicle", "session", "was_staged", "joined", "held", "keyframes", "moved", "rms_move_m", "max_move_m",
                "submaps", "submaps_met", "closures"}


def nothing_cases(merges):
    """Where there is nothing to merge nothing happens, and that is fine."""
    report = merges.report
    empty = merges.merged("an empty daemon")
    report.equal("an empty daemon", (empty["sessions"], empty["applied"]), ([], False))
    people = merges.merge("run").stdout
    report.check("an empty daemon, for people", "nothing to do" in people and "no closures; 0 rejected" in people and
                 "no tiles to be fused again" in people and "0.000" not in people, people)
    merges.ingest("garage")  # in the map at once
    alone = merges.merged("one in the map")  # it is as good as it can be made
    report.equal("one in the map", ([one["joined"] for one in alone["sessions"]], alone["published"]), ([True], 0))
    again = merges.merged("one in the map, twice")
    report.equal("one in the map, twice", (again["applied"], again["keyframes_moved"]), (False, 0))
    report.equal("a retracted session is left out", merges.call("session", "retract", "garage/day").returncode, 0)
    left = merges.merged("one retracted")
    report.equal("one retracted", (left["sessions"], [one["why"] for one in left["left_out"]]), ([], ["retracted"]))
    report.equal("one retracted: restored", merges.call("session", "restore", "garage/day").returncode, 0)


def tables_cases(merges, dry):
    """What is found of each two sessions, and which tiles would change: the same for people and for scripts."""
    report = merges.report
    pairs = {(one["a"]["vehicle"], one["b"]["vehicle"]): one for one in dry["pairs"]}
    met = pairs.get(("first", "second"), {})
    report.equal("a dry run: a pair's keys", set(met), {"a", "b", "closures", "rejected", "rms_m", "rms_deg"})
    report.equal("a dry run: closures by pair", sum(one["closures"] for one in dry["pairs"]), len(dry["closures"]))
    report.equal("a dry run: rejected ones by pair", sum(one["rejected"] for one in dry["pairs"]),
                 len(dry["rejected_closures"]))
    report.check("a dry run: rejected ones", all(set(one) == {"a", "b", "fit", "off_m", "off_deg"}
                                                 for one in dry["rejected_closures"]), dry["rejected_closures"])
    by_level = [sum(tile["level"] == level for tile in dry["fused_tiles"]) for level in range(8)]
    finest = {(tile["x"], tile["y"]) for tile in dry["fused_tiles"] if tile["level"] == 0}
    above = {(tile["x"], tile["y"]) for tile in dry["fused_tiles"] if tile["level"] == 1}
    report.equal("a dry run: tiles of level 0", (by_level[0], len(finest)), (dry["tiles"], dry["tiles"]))
    report.equal("a dry run: tiles above them", above, {(x // 2, y // 2) for x, y in finest})
    report.equal("a dry run: a tile's side", dry["tile_size_m"], 25.6)
    people = merges.merge("run", "--dry-run").stdout
    lines = [" ".join(line.split()) for line in people.splitlines()]
    report.check("a dry run, for people: closures by pair",
                 f"first/day second/day {met['closures']} {met['rejected']} {met['rms_m']:.3f} {met['rms_deg']:.3f}" in lines,
                 people)
    report.check("a dry run, for people: tiles by level",
                 f"tiles to be fused again: {by_level[0]} of level 0, {by_level[1]} of level 1, " in people, people)


def dry_run_cases(merges, work):
    """All that a run tells beforehand, and nothing done."""
    report = merges.report
    picture, corrections = work / "m.png", work / "m.poses"
    before = merges.state()
    dry = merges.merged("a dry run", "--dry-run", "--picture", picture, "--corrections", corrections)
    report.equal("a dry run: keys", set(dry), KEYS)
    by_vehicle = {one["vehicle"]: one for one in dry["sessions"]}
    report.equal("a dry run: a session's keys", set(by_vehicle["first"]), SESSION_KEYS)
    report.equal("a dry run: who stays out is told why", set(by_vehicle["garage"]), SESSION_KEYS | {"why_not"})
    report.equal("a dry run: who belongs together", {name: one["joined"] for name, one in by_vehicle.items()},
                 {"first": True, "second": True, "garage": False})
    report.equal("a dry run: published would be", (dry["published"], dry["applied"]), (2, False))
    report.check("a dry run: closures", len(dry["closures"]) >= 3 and
                 set(dry["closures"][0]) == {"a", "b", "fit", "off_m", "off_deg"}, dry["closures"])
    tables_cases(merges, dry)
    report.equal("a dry run: the picture", picture.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
    lines = corrections.read_text(encoding="ascii").splitlines()
    report.equal("a dry run: corrections", len([line for line in lines if line and line[0] != "#"]),
                 dry["keyframes_moved"])
    report.equal("a dry run: the atlas", merges.state(), before)
    one = merges.merged("one session", "--dry-run", "--session", "second/day")
    report.equal("one session", ([s["vehicle"] for s in one["sessions"]], sorted(o["vehicle"] for o in one["left_out"])),
                 (["second"], ["first", "garage"]))
    merges.call("session", "retract", "second/day")
    out = merges.merge("run", "--dry-run", "--session", "second/day", "--session", "first/day", "--json")
    report.equal("one that is retracted: exit code", out.returncode, EXIT["invalid_data"])
    report.equal("one that is retracted: the other one", json.loads(out.stdout)["published"], 1)
    merges.typed("one that is retracted", out.stderr, "invalid_data", "second/day is not merged: retracted")
    merges.call("session", "restore", "second/day")
    return dry


def backup_cases(merges, folder, dry):
    """From a copy of the atlas, without a daemon: the same, and nothing to apply it to."""
    merges.run("backup", "monday")
    backup = next(path for path in folder.iterdir() if path.is_file())
    content = hashlib.sha256(backup.read_bytes()).hexdigest()
    from_file = merges.merged("a backup", "--atlas", backup, server=False)
    for found in (from_file, dry):
        found.pop("revision", None)
    merges.report.equal("a backup", from_file, dry)
    merges.report.equal("a backup: unchanged", hashlib.sha256(backup.read_bytes()).hexdigest(), content)
    other = folder.parent / "no.db"
    other.write_bytes(b"no atlas" * 1000)
    for name, file, code in (("no backup there", folder / "tuesday", "not_found"), ("no atlas", other, "invalid_data")):
        merges.merge_refused(name, ["run", "--atlas", file], code, server=False)
    merges.merge_refused("a file and a daemon", ["run", "--atlas", backup], "invalid_argument", "--server")


def refused_cases(merges, work):
    merges.merge_refused("an unknown session", ["run", "--session", "nobody/day"], "not_found", "nobody/day")
    for flags in (["--session", "first"], ["--session"], ["more"], ["--workers", "3"], ["--author", "a b"]):
        merges.merge_refused(f"run {flags}", ["run", *flags], "invalid_argument")
    for flag, name in (("--picture", "x.jpg"), ("--changes-picture", "x.gif"), ("--picture", "png")):
        merges.merge_refused(f"{flag} {name}", ["run", flag, work / name], "invalid_argument", ".png")
    (work / "folder").mkdir()
    for flag in ("--picture", "--corrections"):
        merges.merge_refused(f"{flag} in no folder", ["run", flag, work / "none/x"], "not_found", "none/x")
        merges.merge_refused(f"{flag} with a folder's name", ["run", flag, work / "folder"], "conflict", "folder")
        if merges.unprivileged is None:
            merges.report.skip(f"{flag} where nobody may write", "nobody may not run what is built")
        else:
            (work / "locked").mkdir(mode=0o755, exist_ok=True)
            merges.merge_refused(f"{flag} where nobody may write", ["run", flag, work / "locked/x"],
                                 "permission_denied", **merges.unprivileged)
    gone = Merges(merges.report, merges.bin_dir, "127.0.0.1:1", merges.drives)
    done = gone.merge("run", "--json")
    merges.report.equal("no daemon: exit code", done.returncode, 5)
    merges.typed("no daemon", done.stderr, "unavailable", "127.0.0.1:1")


def help_cases(merges):
    for line in ([], ["run"], ["serve"]):
        done = merges.merge(*line, "--help", server=False)
        merges.report.check(f"{line} --help", done.returncode == 0 and "Usage: atlas-merge" in done.stdout and
                            not done.stderr, done)
    version = merges.merge("--version", server=False)
    merges.report.check("--version", version.returncode == 0 and version.stdout.startswith("atlas-merge "), version)
    for line in ([], ["merge"], ["status"]):
        merges.merge_refused(f"no such command: {line}", line, "invalid_argument")


def interrupted_case(merges):
    """A signal during the search ends it, as the system says so, and nothing was applied."""
    before = merges.state()
    for number in (signal.SIGINT, signal.SIGTERM):
        watched = Watched(merges, "run")
        merges.report.check(f"signal {number}: it searches", watched.wait_for("search"), watched.shown)
        watched.process.send_signal(number)
        code, out = watched.end()
        merges.report.equal(f"signal {number}: its end", (code, out), (-number, ""))
    merges.report.equal("interrupted: the atlas", merges.state(), before)


def conflict_case(merges):
    """A keyframe that comes to a session while it is merged: merged again, with it."""
    before = merges.run("sessions")["sessions"]
    report = merges.report
    watched = Watched(merges, "run", "--json")
    report.check("a conflict: it searches", watched.wait_for("search"), watched.shown)
    watched.process.send_signal(signal.SIGSTOP)
    merges.ingest("second", "--staged")  # the rest of it
    watched.process.send_signal(signal.SIGCONT)
    code, out = watched.end()
    report.equal("a conflict: exit code", code, 0)
    report.check("a conflict: it says so", b"merged again" in watched.shown, watched.shown[-500:])
    done = json.loads(out)
    report.equal("a conflict: keys", set(done), APPLIED_KEYS)
    keyframes = {one["vehicle"]: one["keyframes"] for one in done["sessions"]}
    report.check("a conflict: the later keyframes are in it",
                 keyframes["second"] > next(one["keyframes"] for one in before if one["vehicle"] == "second"), keyframes)
    report.equal("a conflict: who is in the map", merges.states(),
                 {"first": "live", "second": "live", "garage": "staged"})
    return done["batch"]


def named_case(merges, work):
    """Who is asked for by name and stays staged is a failure, after all that could be done."""
    report = merges.report
    before = merges.state()
    done = merges.merge("run", "--session", "garage/day")
    report.equal("asked for: exit code", done.returncode, EXIT["invalid_data"])
    report.check("asked for: it was tried", "stays staged" in done.stdout and "nothing to do" in done.stdout, done.stdout)
    report.check("asked for: why not", "garage/day is not merged: meets no session" in done.stderr, done.stderr)
    report.equal("asked for: the atlas", merges.state(), before)
    report.equal("not asked for: exit code", merges.merge("run").returncode, 0)
    done = merges.merge("run", "--changes-picture", work / "none.png")
    report.check("nothing is published: no picture, and it says so",
                 done.returncode == 0 and "none.png is not written" in done.stderr, done)


def twice_case(merges, batch):
    """What was merged stays; undone, it is merged again."""
    report = merges.report
    merges.run("wait")
    before = merges.state()
    again = merges.merged("a second run")
    report.equal("a second run", (again["applied"], again["keyframes_moved"], again["published"]), (False, 0, 0))
    report.equal("a second run: the atlas", merges.state(), before)
    merges.run("poses", "undo", batch)
    report.equal("undone", merges.states(), {"first": "staged", "second": "staged", "garage": "staged"})
    done = merges.merge("run", "--author", "alice")
    report.check("for people", done.returncode == 0 and "published" in done.stdout and
                 f"undone by: atlas poses undo {batch + 2}" in done.stdout, done)
    by = [event["author"] for event in merges.run("log")["events"] if event["kind"] == "poses"]
    report.check("by whom", "alice" in by, by)


def role_cases(report, bin_dir, drives, work):
    """Readers and vehicles do not merge; who merges needs no other right."""
    with Daemon(bin_dir, work / "roles", *COARSE) as daemon:
        Merges(report, bin_dir, daemon.server, drives).staged("first", "second")
    for role, code in (("reader", 1), ("vehicle", 1), ("merge", 0)):
        with Daemon(bin_dir, work / "roles", *COARSE, "--anonymous", role) as daemon:
            done = Merges(report, bin_dir, daemon.server, drives).merge("run", "--json")
        report.equal(f"as {role} ({done.stderr[:200]})", done.returncode, code)
        if code != 0:
            report.equal(f"as {role}: why", json.loads(done.stderr)["error"]["code"], "permission_denied")


def tell(report, bin_dir, drives, work):
    """What a run says, and refuses."""
    with Daemon(bin_dir, work / "nothing", *COARSE) as daemon:
        nothing_cases(Merges(report, bin_dir, daemon.server, drives))
    (work / "backups").mkdir()
    with Daemon(bin_dir, work / "atlas", *COARSE, "--backup-folder", work / "backups") as daemon:
        merges = Merges(report, bin_dir, daemon.server, drives)
        merges.staged("first", "second", "garage")
        backup_cases(merges, work / "backups", dry_run_cases(merges, work))
        refused_cases(merges, work)
        help_cases(merges)


def change(report, bin_dir, drives, work):
    """What a run does, and what keeps it from it."""
    with Daemon(bin_dir, work / "atlas", *COARSE) as daemon:
        merges = Merges(report, bin_dir, daemon.server, drives)
        merges.staged("first", "garage")
        merges.ingest("second", "--staged", "--range", "0:55")
        interrupted_case(merges)
        batch = conflict_case(merges)
        merges.run("wait")
        named_case(merges, work)
        twice_case(merges, batch)
    role_cases(report, bin_dir, drives, work)


def from_cases(merges, other, file):
    """Sessions of another atlas, by its file and by its daemon: brought once, and merged."""
    report = merges.report
    before = merges.state(), merges.states()
    dry = [merges.merged(f"--from {place} and --dry-run", "--from", place, "--dry-run") for place in (file, other.server)]
    report.equal("--from and --dry-run: by a file as by a daemon", dry[0], dry[1])
    report.equal("--from and --dry-run: who would be published",
                 {one["vehicle"]: (one["was_staged"], one["joined"]) for one in dry[0]["sessions"]},
                 {"first": (True, True), "second": (True, True)})
    report.equal("--from and --dry-run: the atlas", (merges.state(), merges.states()), before)
    merges.merge_refused("--from nothing", ["run", "--from", file.parent / "none"], "not_found", "none")
    merges.merge_refused("--from no daemon", ["run", "--from", "127.0.0.1:1"], "unavailable")
    done = merges.merge("run", "--from", file, "--json")
    report.equal(f"--from a file: exit code ({done.stderr})", done.returncode, 0)
    report.equal("--from a file: who is in the map", merges.states(), {"first": "live", "second": "live"})
    closures = json.loads(done.stdout)["closures"]
    report.equal("--from a file: as the dry run said", closures, dry[0]["closures"])
    report.check("--from a file: what came", "1 sessions" in done.stderr and "of which 0 were" in done.stderr,
                 done.stderr)
    before = merges.state()
    again = merges.merge("run", "--from", other.server, "--json")
    report.equal(f"--from a daemon: exit code ({again.stderr})", again.returncode, 0)
    report.check("--from a daemon: all was there", "of which 0 were" not in again.stderr, again.stderr)
    report.equal("--from a daemon: nothing is done", (json.loads(again.stdout)["applied"], merges.state()),
                 (False, before))
    report.equal("--from a daemon: where it is from it stays", other.states(), {"second": "live"})


def kept_cases(merges, work):
    """What was found is kept, and what changed is told."""
    report = merges.report
    folder, changes = work / "kept", work / "changes.csv"
    flags = ("--dry-run", "--work", folder, "--changes", changes, "--changes-picture", work / "changes.png")
    first = merges.merged("with a folder", *flags)
    files = sorted(folder.iterdir())
    report.check("with a folder: it has submaps and a log", {path.suffix for path in files} >= {".submap", ".log"}, files)
    again = merges.merged("with a folder, again", *flags)
    report.equal("with a folder, again: the same", again, first)
    report.equal("with a folder, again: nothing new", sorted(folder.iterdir()), files)
    for path in folder.glob("*.submap"):
        path.unlink()
    report.equal("without its submaps: the same", merges.merged("without its submaps", *flags), first)
    report.check("changes: a list", changes.read_text(encoding="ascii").startswith("kind,vehicle,session,"), changes)
    report.equal("changes: a picture", (work / "changes.png").read_bytes()[:4], b"\x89PNG")
    merges.merge_refused("--changes elsewhere", ["run", "--changes", work / "changes.txt"], "invalid_argument", ".csv")
    merges.merge_refused("--work in a file", ["run", "--work", changes], "conflict")


def bring(report, bin_dir, drives, work):
    """What comes from elsewhere, and what stays for the next time."""
    with Daemon(bin_dir, work / "atlas", *COARSE) as daemon, Daemon(bin_dir, work / "other", *COARSE) as source:
        merges = Merges(report, bin_dir, daemon.server, drives)
        other = Merges(report, bin_dir, source.server, drives)
        merges.staged("first")
        other.ingest("second")
        other.run("wait")
        from_cases(merges, other, work / "other/atlas.db")
    with Daemon(bin_dir, work / "kept_atlas", *COARSE) as daemon:
        merges = Merges(report, bin_dir, daemon.server, drives)
        merges.staged("first", "second")
        kept_cases(merges, work)
    names_case(report, bin_dir, drives, work)
    with Daemon(bin_dir, work / "fine") as daemon:
        merges = Merges(report, bin_dir, daemon.server, drives)
        merges.merge_refused("--from another profile", ["run", "--from", work / "other/atlas.db"], "invalid_argument",
                             "cells of 0.2 m instead of 0.1 m")


def names_case(report, bin_dir, drives, work):
    """Two drives of one name, each in an atlas: who has which is said, and what can be done."""
    with Daemon(bin_dir, work / "one", *COARSE) as one, Daemon(bin_dir, work / "two", *COARSE) as two:
        mine = Merges(report, bin_dir, one.server, drives)
        other = Merges(report, bin_dir, two.server, drives)
        for merges, name in ((mine, "first"), (other, "second")):
            merges.run("ingest", drives / name, *NEAR, "--vehicle", "car", "--session", "day")
        says = f"session car/day: {two.server} has other keyframes under this name than "
        mine.merge_refused("one name", ["run", "--from", two.server], "conflict", says + "the daemon: ")
        mine.merge_refused("one name, a dry run", ["run", "--from", two.server, "--dry-run"], "conflict",
                           says + "the daemon: ")
        mine.merge_refused("one name, a new atlas",
                           ["run", "--from", one.server, "--from", two.server, "--output", work / "new.db"], "conflict",
                           f"{says}{one.server}: ", server=False)
        mine.merge_refused("one name: what to do", ["run", "--from", two.server], "conflict",
                           "atlas session retract car/day")


GROUPS = {"tell": tell, "change": change, "bring": bring}


if __name__ == "__main__":
    sys.exit(run_group(GROUPS))
