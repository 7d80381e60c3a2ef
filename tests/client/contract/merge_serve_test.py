#!/usr/bin/python3
"""`atlas-merge serve` beside a real daemon: what it publishes, what it leaves alone, what it survives.

Usage: merge_serve_test.py BIN_DIR DRIVES sessions|limits|daemon."""

import json
import pathlib
import re
import shutil
import signal
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "support"))
from harness import Daemon, Report  # noqa: E402
from merge_harness import COARSE, Merges, Restartable, Service  # noqa: E402


def reports_of(folder):
    return sorted(path.name.split("-", 2)[2] for path in folder.iterdir())


def published_case(merges, reports):
    """Two that belong together are published; who meets nobody waits for others, and is left in peace."""
    report = merges.report
    merges.staged("first", "second")
    with Service(merges, "--reports", reports) as service:
        applied = service.wait_for("applied", "over_limits")
        report.equal("published", (applied["event"], applied["published"]), ("applied", ["first/day", "second/day"]))
        merges.staged("garage")
        nothing = service.wait_for("nothing")
        report.equal("it meets nobody", nothing["sessions"], ["garage/day"])
        merges.staged("third")
        applied = service.wait_for("applied", "over_limits")
        report.equal("the next one", (applied["event"], applied["published"]), ("applied", ["third/day"]))
        report.equal("who is in the map", merges.states(),
                     {"first": "live", "second": "live", "third": "live", "garage": "staged"})
        merges.run("session", "retract", "first/day", "--reason", "to wake it up")
        merges.run("session", "restore", "first/day")  # changed: worth another look
        report.equal("it looks again", service.wait_for("begun")["sessions"], ["garage/day"])
        report.check("and finds as much", service.wait_for("nothing"))
        report.equal("SIGTERM", service.stop(), 0)
        # Alone, with the third one, and when the map had changed.
        report.equal("merges in all", [event["sessions"] for event in service.of("begun")],
                     [["first/day", "second/day"], ["garage/day"], ["garage/day", "third/day"], ["garage/day"]])
        report.equal("its last word", service.events[-1]["event"], "stopped")
        report.check("fields of a line", all({"time", "level", "message", "event"} <= set(event)
                                             for event in service.events), service.events)
    report.equal("reports", reports_of(reports), ["batch-1.json", "batch-1.png", "batch-2.json", "batch-2.png"])
    found = json.loads(next(reports.glob("*-batch-1.json")).read_text(encoding="utf-8"))
    report.equal("a report", (found["applied"], found["batch"], found["published"], found["over_limits"]),
                 (True, 1, 2, []))
    report.check("a report is named in the log", str(next(reports.glob("*-batch-2.json"))) == applied["report"], applied)
    by = [event for event in merges.run("log")["events"] if event["author"] == "root"]
    report.check("in the log of the atlas", by, by)


def limits_case(merges, reports):
    """Over a limit nothing is applied, but reported once; a hand applies it from the report."""
    report = merges.report
    merges.staged("first", "second")
    with Service(merges, "--reports", reports, "--max-staged-move", "0.01", "--keep-reports", "3") as service:
        over = [service.wait_for("over_limits"), service.wait_for("over_limits")]
        report.equal("over limits, each by itself", [event["sessions"] for event in over],
                     [["first/day"], ["second/day"]])
        report.check("over limits: why", "first/day would move by" in over[0]["message"] and
                     "at most 0.01" in over[0]["message"], over[0])
        merges.staged("garage")  # something for it to do
        report.equal("it goes on with others", service.wait_for("begun")["sessions"], ["garage/day"])
        service.wait_for("over_limits", "applied", "nothing")
        report.equal("SIGTERM", service.stop(), 0)
        report.equal("merges in all", [event["sessions"] for event in service.of("begun")],
                     [["first/day", "second/day"], ["first/day"], ["second/day"], ["garage/day"]])
    report.equal("over limits: the atlas", {merges.states()[name] for name in ("first", "second")}, {"staged"})
    poses = pathlib.Path(over[0]["report"]).with_suffix(".poses")
    report.check("a report with corrections", poses.exists() and poses.with_suffix(".png").exists(), poses)
    found = json.loads(pathlib.Path(over[0]["report"]).read_text(encoding="utf-8"))
    report.equal("a report over limits", (found["applied"], len(found["over_limits"]), found["asked_for"]),
                 (False, 1, ["first/day"]))
    merges.run("poses", "apply", poses, "--if-revision", found["revision"], "--publish", "first/day")
    report.equal("by hand", merges.states()["first"], "live")
    with Service(merges, "--once", "--reports", reports, "--keep-reports", "1", "--max-tiles", "2") as service:
        report.equal("a round: exit code", service.end(), 0)
        report.check("too many tiles", any("tiles would change, at most 2" in event["message"]
                                           for event in service.of("over_limits")), service.events)
    report.equal("the newest report is kept", {name.split(".")[1] for name in reports_of(reports)},
                 {"json", "png", "poses"})


def map_limit_case(merges):
    """What is in the map is not moved farther than it may be."""
    report = merges.report
    merges.ingest("first")
    merges.staged("second")
    with Service(merges, "--max-move", "0.001", "--max-turn-deg", "0.001") as service:
        event = service.wait_for("over_limits", "applied")
        report.check("the map is not moved", event["event"] == "over_limits" and
                     "session first/day would move by" in event["message"], event)
        report.equal("SIGTERM", service.stop(), 0)
    report.equal("the map is not moved: the atlas", merges.states(), {"first": "live", "second": "staged"})
    with Service(merges, "--once", "--max-move", "5", "--max-turn-deg", "5") as service:
        report.equal("a round within limits", service.end(), 0)
    report.equal("a round within limits: the atlas", merges.states(), {"first": "live", "second": "live"})


def daemon_case(report, bin_dir, drives, data):
    """A daemon that is killed is waited for, whether the service had nothing to do or was at work."""
    daemons = Restartable(bin_dir, data, *COARSE)
    merges = Merges(report, bin_dir, daemons.daemon.server, drives)
    try:
        with Service(merges) as service:
            report.check("it watches", service.wait_for("connected"))
            daemons.restart()
            report.check("it notices", service.wait_for("lost"))
            report.check("it comes back", service.wait_for("connected"))
            merges.staged("first", "second")
            begun = service.wait_for("begun")
            service.process.send_signal(signal.SIGSTOP)
            daemons.restart()
            service.process.send_signal(signal.SIGCONT)
            # What settled meanwhile comes along, where this machine took its time to upload it.
            published = service.wait_for("applied")["published"]
            report.check("it merges", set(published) >= set(begun["sessions"]), published)
            report.equal("SIGINT", service.stop(signal.SIGINT), 0)
        report.check("who is in the map", set(merges.states().values()) == {"live"} or len(begun["sessions"]) < 2,
                     merges.states())
    finally:
        daemons.daemon.stop()


def other_atlas_cases(report, bin_dir, drives, work):
    """A backup that is restored is looked at anew; another atlas at the same place takes people."""
    (work / "backups").mkdir()
    flags = (*COARSE, "--backup-folder", work / "backups")
    daemon = Daemon(bin_dir, work / "one", *flags)
    merges = Merges(report, bin_dir, daemon.server, drives)
    try:
        merges.ingest("first")
        merges.staged("garage")
        with Service(merges, "--max-move", "5") as service:  # the map itself is not merged yet
            report.equal("before", service.wait_for("nothing", "applied")["sessions"], ["garage/day"])
            merges.run("backup", "monday")
            daemon.stop()
            merges.run("restore", next((work / "backups").iterdir()), "--to", work / "one/atlas.db", "--replace")
            daemon = Daemon(bin_dir, work / "one", *flags, listen=merges.server)
            report.equal("a restored backup", service.wait_for("nothing", "applied")["sessions"], ["garage/day"])
            daemon.stop()
            daemon = Daemon(bin_dir, work / "two", *flags, listen=merges.server)
            report.equal("another atlas", service.end(), 4)
            report.check("another atlas: why", "another atlas" in str(service.events[-1]), service.events[-1])
    finally:
        daemon.stop()


def unit_case(merges, work, unit):
    """The command line of the unit, as systemd would make it."""
    line = re.search(r"^ExecStart=\S+ (.*)$", unit.read_text(encoding="utf-8"), re.M).group(1)
    words = line.replace("${STATE_DIRECTORY}", str(work / "state")).replace("$ATLAS_MERGE_FLAGS", "--settle 0").split()
    merges.staged("first")
    done = merges.merge(*words, "--once")
    merges.report.equal(f"the unit: exit code ({done.stderr})", done.returncode, 0)
    merges.report.equal("the unit: who is in the map", merges.states(), {"first": "live"})
    merges.report.equal("the unit: reports", reports_of(work / "state/reports"), ["batch-1.json", "batch-1.png"])
    merges.report.equal("the unit: by whom", {event["author"] for event in merges.run("log")["events"]}, {"atlas-merge"})


def no_report_case(merges, reports):
    """A report that cannot be written keeps no session from the map."""
    merges.staged("first", "second")
    with Service(merges, "--reports", reports) as service:
        service.wait_for("begun")
        service.process.send_signal(signal.SIGSTOP)
        shutil.rmtree(reports)
        service.process.send_signal(signal.SIGCONT)
        merges.report.check("no report: it says so", service.wait_for("no_report", "put_off")["event"] == "no_report",
                            service.events)
        applied = service.wait_for("applied")
        merges.report.equal("no report", (applied["published"], "report" in applied),
                            (["first/day", "second/day"], False))


def stopped_case(merges):
    """SIGTERM at work: at once, in good order, and nothing was done."""
    report = merges.report
    merges.staged("first", "second")
    before = merges.state()
    with Service(merges) as service:
        report.check("it begins", service.wait_for("begun"))
        report.equal("SIGTERM at work", service.stop(), 0)
        report.equal("SIGTERM at work: events", [event["event"] for event in service.events],
                     ["connected", "begun", "stopped"])
    report.equal("SIGTERM at work: the atlas", merges.state(), before)


def conflict_case(merges):
    """Uploads to a session that is merged put it off until they have ended."""
    report = merges.report
    merges.staged("first")
    merges.ingest("second", "--staged", "--range", "0:55")
    with Service(merges) as service:
        report.check("it begins", service.wait_for("begun"))
        service.process.send_signal(signal.SIGSTOP)
        merges.ingest("second", "--staged")
        service.process.send_signal(signal.SIGCONT)
        put_off = service.wait_for("put_off", "applied")
        report.equal("put off", (put_off["event"], put_off.get("code")), ("put_off", "conflict"))
        report.check("put off: why", "second/day" in put_off["message"], put_off)
        published = []
        while len(published) < 2 and (event := service.wait_for("applied", "over_limits")):
            published += event.get("published", [event["message"]])
        report.equal("merged again", published, ["first/day", "second/day"])
        report.equal("SIGTERM", service.stop(), 0)


def refused_cases(merges, work):
    for flags, says in ((["--every", "0"], "--every: "), (["--settle", "-1"], ""), (["--max-move", "-1"], "--max-move: -1"),
                        (["--max-move", "nan"], ""), (["--max-turn-deg", "-1"], "--max-turn-deg: -1"),
                        (["--max-tiles", "-1"], ""), (["--keep-reports", "0"], "--keep-reports"),
                        (["--author", "a b"], ""), (["--atlas", "x"], ""), (["more"], "")):
        merges.merge_refused(f"serve {flags}", ["serve", *flags], "invalid_argument", says)
    (work / "file").write_text("")
    merges.merge_refused("reports in a file", ["serve", "--reports", work / "file"], "conflict", "file")
    if merges.unprivileged is None:
        merges.report.skip("reports where nobody may write", "nobody may not run what is built")
    else:
        (work / "locked").mkdir(mode=0o755)
        merges.merge_refused("reports where nobody may write", ["serve", "--reports", work / "locked"],
                             "permission_denied", **merges.unprivileged)


def role_cases(report, bin_dir, drives, data):
    for role, code in (("reader", 1), ("merge", 0)):
        with Daemon(bin_dir, data, *COARSE, "--anonymous", role) as daemon:
            merges = Merges(report, bin_dir, daemon.server, drives)
            with Service(merges, "--once") as service:
                report.equal(f"as {role}: exit code", service.end(), code)
                if code != 0:
                    report.check(f"as {role}: why", "expected role merge or admin" in str(service.events[-1]),
                                 service.events)
    with Service(Merges(report, bin_dir, "127.0.0.1:1", drives), "--once") as service:
        report.equal("a round without a daemon", service.end(), 5)
        last = str(service.events[-1])
        report.check("a round without a daemon: why", "127.0.0.1:1" in last and "next attempt" not in last, last)


def main():
    bin_dir, drives, group = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
    report = Report()
    with tempfile.TemporaryDirectory() as name:
        work = pathlib.Path(name)
        work.chmod(0o755)

        def beside_a_daemon(case, *args):
            with Daemon(bin_dir, work / case.__name__, *COARSE) as daemon:
                case(Merges(report, bin_dir, daemon.server, drives), *args)
        if group == "sessions":
            beside_a_daemon(published_case, work / "reports")
            beside_a_daemon(conflict_case)
        elif group == "limits":
            beside_a_daemon(limits_case, work / "reports")
            beside_a_daemon(map_limit_case)
            beside_a_daemon(no_report_case, work / "gone")
        else:
            beside_a_daemon(refused_cases, work)
            beside_a_daemon(stopped_case)
            daemon_case(report, bin_dir, drives, work / "daemon")
            role_cases(report, bin_dir, drives, work / "roles")
            other_atlas_cases(report, bin_dir, drives, work)
            unit = pathlib.Path(__file__).resolve().parents[3] / "deploy/atlas-merge.service"
            beside_a_daemon(unit_case, work, unit)
    print(f"{report.checks} checks, {report.failed} failed")
    return 1 if report.failed else 0


if __name__ == "__main__":
    sys.exit(main())
