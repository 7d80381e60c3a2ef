#!/usr/bin/python3
"""Sessions retracted and restored, and the atlas as of earlier revisions, through `atlas` and `atlasd`.
Usage: history_test.py BIN_DIR DRIVE; DRIVE is a simulated street."""

import contextlib
import json
import os
import pathlib
import pwd
import sqlite3
import struct
import sys
import tempfile

import xxhash

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))

from harness import NEAR, SMALL, Cases, Daemon, Drives, Report

PLACE = ("1", "-1.6")
AREA = ("--center", "0,0", "--radius", "20")


def checksum_of_counter(number, value):
    """docs/formats/store.md, "Checksums"."""
    unsigned = xxhash.xxh64_intdigest(struct.pack("<BqQ", 12, number, value))
    return struct.unpack("<q", struct.pack("<Q", unsigned))[0]


class Moment:
    """Everything that the atlas shows at a revision, now or with --at."""

    def __init__(self, cases, work, at=None):
        past = () if at is None else ("--at", at)
        digest = cases.run("digest", *past)
        self.digest, self.tiles, self.revision = digest["digest"], digest["tiles"], digest["revision"]
        self.layers = cases.run("point", *PLACE, *past)["layers"]
        with tempfile.TemporaryDirectory(dir=work) as folder:
            summary = cases.run("query", *AREA, "-o", folder, *past)
            self.files = {file.name: file.read_bytes() for file in pathlib.Path(folder).iterdir()}
        self.query = summary["tiles"], summary["bytes"], summary["truncated"]
        self.query_revision = summary["revision"]


def same(cases, name, found, expected):
    for what in ("digest", "tiles", "layers", "files"):
        is_same = getattr(found, what) == getattr(expected, what)
        cases.report.check(f"{name}: {what}", is_same, getattr(found, what))


def past_cases(cases, work, moments):
    for name, moment in moments.items():
        past = Moment(cases, work, moment.revision)
        same(cases, f"{name}, read back", past, moment)
        cases.report.equal(f"{name}, read back: revisions", (past.revision, past.query_revision),
                           (moment.revision, moment.revision))
    empty = Moment(cases, work, 0)
    cases.report.equal("revision 0", (empty.tiles, empty.layers, empty.query[0], empty.revision), (0, [], 0, 0))


def session_state(cases, name):
    return {session["session"]: session["state"] for session in cases.run("sessions")["sessions"]}[name]


def change(cases, word, name, state, is_news):
    before = cases.run("status")["revision"]
    done = cases.run("session", word, f"vehicle/{name}")
    cases.report.check(f"{word}: keys", {"tiles_marked", "revision", "state", "changed"} <= set(done), done)
    cases.report.equal(f"{word}: state", (done["state"], session_state(cases, name)), (state, state))
    cases.report.equal(f"{word}: something changed", (done["changed"], done["tiles_marked"] > 0), (is_news, is_news))
    if not is_news:
        cases.report.equal(f"{word} again: revision", (done["revision"], cases.run("status")["revision"]),
                           (before, before))
    cases.run("wait")


def live_cases(cases, drives, work):
    """What the atlas was at each of a few revisions."""
    moments = {}

    def remember(name):
        moments[name] = Moment(cases, work)
        return moments[name]

    cases.run("ingest", drives.good, *NEAR)
    one = remember("one session")
    cases.report.check("one session: tiles", one.tiles > 0 and one.layers and one.files, vars(one))
    cases.run("ingest", drives.good, *NEAR, "--session", "second", "--shuffle", "3")
    two = remember("two sessions")
    cases.report.check("two sessions: another map", two.digest != one.digest, two.digest)
    change(cases, "retract", "second", "retracted", True)
    same(cases, "the second retracted", remember("the second retracted"), one)
    change(cases, "retract", "second", "retracted", False)
    text = cases.call("session", "retract", "vehicle/second")
    cases.report.equal("retract twice: exit code and stderr", (text.returncode, text.stderr), (0, ""))
    cases.report.check("sessions as a table", "retracted" in cases.call("sessions").stdout)
    done = cases.run("ingest", drives.good, *NEAR, "--session", "second")
    cases.report.equal("uploads to a retracted session", (done["acked"], done["duplicates"]), (5, 5))
    correction = pathlib.Path(work) / "corrections.txt"
    correction.write_text("vehicle second 0 1 0 0 0.75 0 1 0 -1.6 0 0 1 1.8\n", encoding="ascii")
    moved = cases.run("poses", "apply", correction)
    cases.report.equal("poses of a retracted session", (moved["updated"], moved["tiles_marked"]), (1, 0))
    same(cases, "still without the second", remember("still without the second"), one)
    change(cases, "restore", "second", "live", True)
    back = remember("back and moved")
    cases.report.check("back and moved: another map", back.digest not in (one.digest, two.digest), back.digest)
    change(cases, "restore", "second", "live", False)
    change(cases, "retract", "good", "retracted", True)
    remember("only the second")
    change(cases, "retract", "second", "retracted", True)
    cases.report.equal("nothing left", remember("nothing left").tiles, 0)
    change(cases, "restore", "second", "live", True)
    change(cases, "restore", "good", "live", True)
    same(cases, "all restored", remember("all restored"), back)
    return moments


def correction_cases(cases, work):
    """A batch on a condition, refused because something changed since, and undone."""
    def file_of(y_m):
        path = pathlib.Path(work) / "moved.txt"
        path.write_text(f"vehicle good 1 1 0 0 0.5 0 1 0 {y_m} 0 0 1 1.8\n", encoding="ascii")
        return path

    def digest():
        return cases.run("digest")["digest"]

    before, computed_at = digest(), cases.run("status")["revision"]
    done = cases.run("poses", "apply", file_of(-1.2), "--if-revision", computed_at, "--publish", "vehicle/good")
    cases.report.equal("a batch on a condition", (done["updated"], done["sessions"]), (1, []))
    cases.report.check("a batch on a condition: another map", digest() != before)
    cases.refused("a batch on a condition that does not hold",
                  ["poses", "apply", file_of(-0.8), "--if-revision", computed_at], "conflict",
                  f"session vehicle/good changed since revision {computed_at}")
    cases.refused("a batch of a revision to come", ["poses", "apply", file_of(-0.8), "--if-revision", "99999999"],
                  "invalid_argument", "there is no revision 99999999 yet")
    cases.refused("a session to be published that is none",
                  ["poses", "apply", file_of(-0.8), "--publish", "vehicle/nobody"], "not_found", "vehicle/nobody")
    text = cases.call("poses", "undo", str(done["batch"]), "--author", "surveyor")
    cases.report.equal("undo: exit code and stderr", (text.returncode, text.stderr), (0, ""))
    cases.report.check("undo: text", f"batch {done['batch'] + 1}\n" in text.stdout, text.stdout)
    cases.report.equal("undone", digest(), before)
    cases.refused("undo again", ["poses", "undo", str(done["batch"])], "conflict", "keyframe vehicle/good/1 was corrected")
    cases.refused("undo what never was", ["poses", "undo", "4711"], "not_found", "there is no batch 4711")
    event = cases.run("log")["events"][-1]
    cases.report.equal("undo in the log", (event["kind"], event["author"], event["subject"]),
                       ("poses_undone", "surveyor", f"batch {done['batch'] + 1}"))


def wild_cases(cases, drives):
    """A drive that is faster than the daemon believes: out of the map, released, and purged."""
    before = cases.run("digest")["digest"]
    quarantined = cases.run("status")["quarantined"]
    wild = drives.copy("wild")
    done = cases.run("ingest", wild, *NEAR)
    cases.report.equal("a wild drive: all are taken", (done["acked"], done["duplicates"]), (5, 0))
    session = {session["session"]: session for session in cases.run("sessions")["sessions"]}["wild"]
    cases.report.equal("a wild drive: state", (session["state"], cases.run("status")["quarantined"]),
                       ("quarantined", quarantined + 1))
    cases.report.check("a wild drive: reason", "keyframe 0 to 1: 1 m in 0.25 s" in session["reason"], session["reason"])
    cases.report.check("a wild drive: table", session["reason"] in cases.call("sessions").stdout)
    cases.report.equal("a wild drive: the map", cases.run("digest")["digest"], before)
    event = cases.run("log")["events"][-1]
    cases.report.equal("a wild drive: log", (event["kind"], event["author"], event["subject"], event["detail"]),
                       ("session_quarantined", "atlasd", "vehicle/wild", session["reason"]))
    change(cases, "release", "wild", "released", True)
    change(cases, "release", "wild", "released", False)
    cases.report.check("released: another map", cases.run("digest")["digest"] != before)
    revision = cases.run("status")["revision"]
    cases.refused("purge without --yes", ["session", "purge", "vehicle/wild"], "invalid_argument", "--yes")
    cases.report.equal("purge without --yes: nothing happened", cases.run("status")["revision"], revision)
    purged = cases.run("session", "purge", "vehicle/wild", "--yes")
    cases.report.equal("purged", (purged["state"], purged["changed"], purged["keyframes_deleted"]), ("purged", True, 5))
    cases.run("wait")
    cases.report.equal("purged: the map", cases.run("digest")["digest"], before)
    cases.refused("purged: --at before", ["digest", "--at", purged["revision"] - 1], "not_found",
                  f"the oldest is {purged['revision']}")
    for word in ("retract", "restore", "release"):
        cases.refused(f"purged: {word}", ["session", word, "vehicle/wild"], "conflict", "purged")
    again = cases.run("session", "purge", "vehicle/wild", "--yes")
    cases.report.equal("purged again", (again["changed"], again["keyframes_deleted"]), (False, 0))
    kinds = [event["kind"] for event in cases.run("log")["events"]]
    cases.report.equal("log of all that", kinds[-3:], ["session_quarantined", "session_released", "session_purged"])


def refused_cases(cases):
    for word in ("retract", "restore", "release"):
        for name in ("vehicle/nobody", "nobody/good"):
            cases.refused(f"session {word} {name}", ["session", word, name], "not_found", name)
        for name in ("vehicle", "", "/", "vehicle/", "/good", "vehicle/good/1", "a b/c", "ä/b", "x" * 65 + "/good"):
            cases.refused(f"session {word} {name[:20]!r}", ["session", word, name], "invalid_argument")
    revision = cases.run("status")["revision"]
    for line in (["digest"], ["point", *PLACE], ["query", *AREA]):
        name = f"{line[0]} --at"
        for later in (revision + 1, 2**63, 2**64 - 1):
            cases.refused(f"{name} {later}", [*line, "--at", later], "invalid_argument",
                          f"there is no revision {later} yet")
        for none in ("-1", "x", "", "1.5", "18446744073709551616", "nan", "1e3"):
            cases.refused(f"{name} {none!r}", [*line, "--at", none], "invalid_argument")
    cases.refused("digest --at in no time", ["digest", "--at", revision, "--timeout", "0"], "timeout", "in time")


def account_cases(cases):
    """Who did it, and why."""
    login = pwd.getpwuid(os.geteuid()).pw_name
    cases.run("session", "retract", "vehicle/good")
    cases.run("session", "restore", "vehicle/good", "--author", "alice", "--reason", "it was right")
    cases.run("vehicle", "retract", "vehicle", "--author", "bob", "--reason", "rain")
    cases.run("vehicle", "restore", "vehicle")
    cases.run("session", "release", "vehicle/good", "--reason", "looked at")
    told = [(event["kind"], event["author"], event["subject"], event["detail"]) for event in cases.run("log")["events"]]
    cases.report.equal("who and why", told[-7:],
                       [("retract", login, "vehicle/good", ""), ("restore", "alice", "vehicle/good", "it was right"),
                        ("retract", "bob", "vehicle/good", "rain"), ("retract", "bob", "vehicle/second", "rain"),
                        ("restore", login, "vehicle/good", ""), ("restore", login, "vehicle/second", ""),
                        ("session_released", login, "vehicle/good", "looked at")])
    for words in (["--author", "a b"], ["--author", "x" * 65], ["--author", ""], ["--reason", "x" * 257],
                  ["--reason", "two\nlines"]):
        cases.refused(f"retract {words[0]} {words[1][:10]!r}", ["session", "retract", "vehicle/good", *words],
                      "invalid_argument")


def impossible_cases(cases, drives):
    """A drive with a pose somewhere else: ingest says so, and the daemon keeps it out."""
    broken = drives.copy("broken")
    lines = (broken / "poses.txt").read_text(encoding="ascii").splitlines()
    numbers = lines[2].split()
    numbers[3] = str(float(numbers[3]) + 5_000)
    lines[2] = " ".join(numbers)
    (broken / "poses.txt").write_text("\n".join(lines) + "\n", encoding="ascii")
    done = cases.call("ingest", broken, *NEAR, "--json")
    cases.report.equal("an impossible drive: exit code", done.returncode, 0)
    report = json.loads(done.stdout)
    cases.report.equal("an impossible drive: sessions and steps", (report["sessions"], report["impossible_steps"]),
                       (1, 2))
    cases.report.check("an impossible drive: note", "2 steps look impossible (keyframe 1 to 2: 500" in done.stderr and
                       "atlas session release" in done.stderr, done.stderr)
    cases.report.equal("an impossible drive: state", session_state(cases, "broken"), "quarantined")


def forgotten_cases(cases, revision):
    for line in (["digest"], ["point", *PLACE], ["query", *AREA]):
        cases.refused(f"{line[0]} --at before the horizon", [*line, "--at", revision - 1], "not_found",
                      f"the oldest is {revision}")
        done = cases.call(*line, "--at", revision, "--json")
        cases.report.equal(f"{line[0]} --at the horizon", done.returncode, 0)


def main():
    bin_dir, source = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    report = Report()
    with tempfile.TemporaryDirectory() as work:
        data = work + "/atlas"
        drives = Drives(source, work + "/drives")
        with Daemon(bin_dir, data, *SMALL) as daemon:
            cases = Cases(report, bin_dir, daemon.server)
            moments = live_cases(cases, drives, work)
            refused_cases(cases)
        with Daemon(bin_dir, data) as daemon:
            cases = Cases(report, bin_dir, daemon.server)
            past_cases(cases, work, moments)
            report.equal("nothing left of the digests' scratch", [path.name for path in pathlib.Path(data).iterdir()
                                                                  if "scratch" in path.name], [])
        horizon = moments["two sessions"].revision
        with contextlib.closing(sqlite3.connect(data + "/atlas.db")) as database, database:
            database.execute("UPDATE counters SET value = ?, checksum = ? WHERE name = 'history_horizon'",
                             (horizon, checksum_of_counter(11, horizon)))
        with Daemon(bin_dir, data) as daemon:
            forgotten_cases(Cases(report, bin_dir, daemon.server), horizon)
            account_cases(Cases(report, bin_dir, daemon.server))
            correction_cases(Cases(report, bin_dir, daemon.server), work)
            impossible_cases(Cases(report, bin_dir, daemon.server), drives)
        with Daemon(bin_dir, data, "--quarantine-max-speed-mps", "1", "--quarantine-max-jump-m", "0") as daemon:
            wild_cases(Cases(report, bin_dir, daemon.server), drives)
    print(f"{report.checks} checks, {report.failed} failed")
    return 1 if report.failed else 0


if __name__ == "__main__":
    sys.exit(main())
