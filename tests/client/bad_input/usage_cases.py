"""Command lines that make no sense, and those that look odd but do."""

from harness import NEAR, Drives

LONG = "x" * 65

USAGE = {
    "ingest": [
        [], ["DRIVE", "more"], ["DRIVE", "--bogus"], ["DRIVE", "--vehicle"], ["DRIVE", "--vehicle", ""],
        ["DRIVE", "--vehicle", "a/b"], ["DRIVE", "--vehicle", "a b"], ["DRIVE", "--vehicle", LONG],
        ["DRIVE", "--session", "ä"], ["DRIVE", "--session", LONG], ["DRIVE", "--session", ""],
        ["DRIVE", "--rings", "0"], ["DRIVE", "--rings", "65"], ["DRIVE", "--rings", "-16"],
        ["DRIVE", "--rings", "16.5"], ["DRIVE", "--max-range", "0"], ["DRIVE", "--max-range", "-20"],
        ["DRIVE", "--max-range", "1e9"], ["DRIVE", "--max-range", "nan"], ["DRIVE", "--max-range", "20m"],
        ["DRIVE", "--every", "-1"], ["DRIVE", "--every", "inf"], ["DRIVE", "--scans", "some"],
        ["DRIVE", "--range", "5"], ["DRIVE", "--range", "5:2"], ["DRIVE", "--range", "a:b"],
        ["DRIVE", "--range", "-1:3"], ["DRIVE", "--shuffle", "-1"], ["DRIVE", "--shuffle", "x"],
        ["DRIVE", "--batch", "0"], ["DRIVE", "--batch", "-1"], ["DRIVE", "--sensor-height", "0"],
        ["DRIVE", "--sensor-height", "-1.7"], ["DRIVE", "--sensor-height", "100"],
        ["DRIVE", "--prior-height", "1,1"], ["DRIVE", "--resume"], ["DRIVE", "--anchor", "--prior-height", "1"],
        ["DRIVE", "--anchor", "--prior-height", "1,0"], ["DRIVE", "--anchor", "--prior-height", "x,1"],
        ["DRIVE", "--deskew", "maybe"], ["DRIVE", "--start", "today"], ["DRIVE", "--revolution", "0.1"],
        *(["DRIVE", "--deskew", "on", "--revolution", turn] for turn in ("0", "-0.1", "nan", "3", "fast")),
        ["DRIVE", "--every", "1", "--every", "2"],
    ],
    "wait": [["now"], ["--timeout", "-1"], ["--timeout", "nan"], ["--timeout", "soon"], ["--timeout", "1e9"]],
    "status": [["more"], ["--verbose"], ["--atlas", "WORK/x.db"]],
    "point": [[], ["1"], ["1", "2", "3"], ["1", "x"], ["nan", "0"], ["0", "inf"], ["1e30", "0"],
              ["1", "2", "--atlas"], ["1", "2", "--atlas", "WORK/x.db"],  # and --server, which all lines have
              ["1e8", "-1e8"], ["1,2"], ["-x", "1"]],
    "query": [
        [], ["--center", "0,0"], ["--radius", "5"], ["--center", "0", "--radius", "5"],
        ["--center", "0,0,0", "--radius", "5"], ["--center", "0,0", "--radius", "-5"],
        ["--center", "0,0", "--radius", "nan"], ["--center", "0,0", "--radius", "1e30"],
        ["--center", "1e30,0", "--radius", "5"], ["--center", "0,0", "--radius", "5", "--level", "-1"],
        ["--center", "0,0", "--radius", "5", "--level", "99"],
        ["--center", "0,0", "--radius", "5", "--level", "1000"],
        ["--center", "0,0", "--radius", "5", "--budget", "0"],
        ["--center", "0,0", "--radius", "5", "--budget", "1"],
        ["--center", "0,0", "--radius", "5", "--budget", "-1"],
        ["--center", "0,0", "--radius", "5", "--budget", "1MB"],
    ],
    "watch": [
        [], ["--center", "0,0"], ["--radius", "5"], ["--center", "0,0", "--radius", "-5"],
        ["--center", "0,0", "--radius", "nan"], ["--center", "1e30,0", "--radius", "5"],
        ["--center", "0,0", "--radius", "5", "--level", "99"],
        ["--center", "0,0", "--radius", "5", "--interval", "-1"],
        ["--center", "0,0", "--radius", "5", "--for", "soon"],
    ],
    "poses": [[], ["apply"], ["revert"], ["apply", "a", "b"], ["undo"], ["undo", "first"], ["undo", "-1"],
              ["undo", "1", "2"], ["apply", "a", "--if-revision", "x"], ["apply", "a", "--if-revision", "0"],
              ["apply", "a", "--publish", "vehicle"], ["apply", "a", "--publish"],
              ["apply", "a", "--publish", "v/s", "v/t"], ["apply", "a", "--publish", "v/a b"]],
    "sessions": [["more"], ["--atlas", "WORK/x.db"]],
    "session": [[], ["retract"], ["restore"], ["purge", "vehicle/good"], ["retract", "vehicle/good", "more"],
                ["restore", "vehicle"], ["retract", "vehicle/good/1"], ["retract", "--at", "1", "vehicle/good"]],
    "compact": [[], ["more"], ["--before"], ["--before", "yesterday"], ["--before", "-1"], ["--before", "nan"],
                ["--before", "1e13"], ["--before", "1", "--timeout", "-1"], ["--before", "1", "--before", "2"],
                ["--before", "1", "more"]],
    "backup": [[], ["a", "b"], ["monday", "--timeout", "-1"], ["monday", "--to", "x"], ["monday", "--atlas", "WORK/x.db"]],
    "backups": [["more"]],
    "restore": [[], ["WORK/x"], ["WORK/x", "--to"], ["--to", "WORK/atlas.db"], ["WORK/x", "WORK/y", "--to", "WORK/atlas.db"],
                ["WORK/x", "--to", "WORK/atlas.db", "--timeout", "5"]],
    "digest": [["more"], ["--timeout", "-1"], ["--at"], ["--at", "-1"], ["--at", "first"], ["--at", "1", "--at", "2"]],
    "verify": [["more"], ["--rebuild=often"], ["--timeout", "x"]],
    "segment": [
        [], ["DRIVE", "--threshold", "0"], ["DRIVE", "--threshold", "-1"], ["DRIVE", "--threshold", "nan"],
        ["DRIVE", "--threshold", "2"], ["DRIVE", "--mode", "best"], ["DRIVE", "--rings", "0"],
        ["DRIVE", "--rings", "1000"],
    ],
    "localize": [
        [], ["DRIVE", "--perturb", "1"], ["DRIVE", "--perturb", "-1,1"], ["DRIVE", "--perturb", "nan,1"], ["DRIVE", "--perturb", "30,1"],
        ["DRIVE", "--perturb", "1,1", "--no-restart"],
        ["DRIVE", "--trials", "5"], ["DRIVE", "--perturb", "1,1", "--trials", "0"],
        ["DRIVE", "--max-range", "0"], ["DRIVE", "--max-range", "1e6"], ["DRIVE", "--rings", "0"],
        ["DRIVE", "--scans", "none"], ["DRIVE", "--seed", "-1"], ["DRIVE", "--mode", "guess"],
        ["DRIVE", "--relocalize", "--prior-radius", "0"], ["DRIVE", "--relocalize", "--prior-height", "-1"],
        ["DRIVE", "--prior-radius", "0"], ["DRIVE", "--prior-height", "nan"], ["DRIVE", "--prior-height", "1e6"],
        ["DRIVE", "--prior-radius", "5", "--perturb", "1,1"], ["DRIVE", "--prior-height", "1", "--mode", "paper"],
        ["DRIVE", "--relocalize", "--perturb", "1,1"], ["DRIVE", "--relocalize", "--mode", "paper"],
        ["DRIVE", "--revolution", "0.1"], ["DRIVE", "--relocalize", "--revolution", "0.1"], ["DRIVE", "--deskew", "auto", "--revolution", "0"],
        ["DRIVE", "--relocalize", "--output", "WORK/x.tum"], ["DRIVE", "--relocalize", "--plot", "WORK/x.svg"], ["DRIVE", "--relocalize", "--no-restart"],
        ["DRIVE", "--output", "WORK/x.txt"], ["DRIVE", "--output", "WORK/x"], ["DRIVE", "--plot", "WORK/x.jpg"],
        ["DRIVE", "--contradictions", "WORK/x.txt"], ["DRIVE", "--contradictions", "WORK/x"],
        *(["DRIVE", "--contradictions", "WORK/x.csv", *other] for other in (
            ["--relocalize"], ["--perturb", "1,1"], ["--mode", "paper"])),
        ["DRIVE", "--output", "WORK/x.tum", "--perturb", "1,1"], ["DRIVE", "--mode", "paper", "--max-range", "150"],
    ],
    "plan": [
        [], ["--from", "0,0,0"], ["--from", "0,0", "--to", "1,1,1"], ["--from", "0,0,0", "--to", "nan,0,0"],
        ["--from", "0,0,0", "--to", "1e30,0,0"], ["--from", "0,0,0", "--to", "5,0,0", "--max-slope-deg", "-5"],
        ["--from", "0,0,0", "--to", "5,0,0", "--max-slope-deg", "90"],
        ["--from", "0,0,0", "--to", "5,0,0", "--max-slope-deg", "steep"],
        *(["--from", "0,0,0", "--to", "5,0,0", *wrong] for wrong in (
            ["--width", "99"], ["--width", "nan"], ["--margin", "-1"], ["--headroom", "-2"], ["--max-step", "5"],
            ["--max-gap", "9"], ["--comfort", "-1"], ["--comfort-weight", "1e9"], ["--max-expansions", "-1"],
            ["--max-expansions", "0"], ["--max-time", "-1"], ["--max-time", "0"], ["--max-memory", "much"],
            ["--max-memory", "0"], ["-o", "WORK/route.txt"])),
    ],
    "export": [[], ["--points"], ["--points", "WORK/x.las"], ["--points", "WORK/x"],
               ["--points", "WORK/x.pcd", "--center", "0,0"], ["--points", "WORK/x.pcd", "--radius", "5"],
               ["--points", "WORK/x.ply", "--center", "0,0", "--radius", "-5"],
               ["--points", "WORK/x.ply", "--center", "0,nan", "--radius", "5"]],
    "render": [[], ["-o"], ["-o", "WORK/x.jpg"], ["-o", "WORK/x"], ["-o", "WORK/x.png", "--layer", "middle"], ["-o", "WORK/x.png", "--layer", "-1"],
               ["-o", "WORK/x.png", "--color", "pink"], ["-o", "WORK/x.png", "--contradictions", "WORK/x.txt"]],
    "simulate": [[], ["street"], ["moon", "-o", "WORK/moon"], ["street", "-o", "WORK/s", "--sensor", "sonar"],
                 *(["street", "-o", "WORK/s", "--revolution", turn] for turn in ("-0.1", "0.3", "nan", "fast")),
                 ["city", "-o", "WORK/s", "--trajectory", "DRIVE/poses.txt", "--revolution", "0.2"],
                 ["street", "-o", "WORK/s", "--seed", "-1"], ["WORK/x.obj", "-o", "WORK/s"],
                 ["street", "-o", "WORK/s", "--trajectory", "DRIVE/poses.txt"],
                 ["street", "-o", "WORK/s", "--every", "2"], ["city", "-o", "WORK/s", "--every", "2"],
                 ["WORK/x.obj", "-o", "WORK/s", "--trajectory", "DRIVE/poses.txt", "--every", "-1"],
                 *(["street", "-o", "WORK/s", "--gnss", noise] for noise in (
                     "0", "-0.5", "nan", "inf", "much", "0.5,", "0.5,-1", "0.5,x", "0.5,1,2", "0.5,1,-1", "0.5,1,0,0", "0.5,,0", "1e6", ""))],
}


def usage_cases(cases, drives):
    def filled(word):
        return word.replace("DRIVE", str(drives.good)).replace("WORK", str(drives.folder))

    for command, lines in USAGE.items():
        before = cases.state()
        for line in lines:
            cases.refused_line(" ".join([command, *line]), [command, *map(filled, line)], "invalid_argument")
        cases.report.equal(f"{command}: the atlas", cases.state(), before)
    cases.refused("no command", [], "invalid_argument")
    cases.refused("unknown command", ["teleport"], "invalid_argument", "teleport")
    cases.typed("unknown command after a flag", cases.call("--json", "teleport").stderr, "invalid_argument",
                "teleport")
    cases.report.check("no picture or drive of a refused command", not list(drives.folder.glob("[xsm]*")),
                       list(drives.folder.iterdir()))


def usage_before_the_daemon_cases(cases, drives):
    """A mistake on the command line is told whether a daemon is there or not."""
    nobody = type(cases)(cases.report, cases.bin_dir, "127.0.0.1:9")
    for line in (["ingest", drives.good, "--rings", "0"], ["ingest", drives.good, "--every", "-1"],
                 ["ingest", drives.good, "--batch", "0"], ["localize", drives.good, "--rings", "0"],
                 ["localize", drives.good, "--max-range", "0"], ["localize", drives.good, "--output", "x.txt"],
                 ["export", "--points", "x.txt"], ["query", "--center", "0,0", "--radius", "-1"],
                 ["query", "--center", "0,0", "--radius", "1", "--budget", "0"]):
        done = nobody.call(*line, "--json")
        cases.report.equal(f"{line} without a daemon", done.returncode, 2)
        cases.typed(f"{line} without a daemon", done.stderr, "invalid_argument", "")
    for server in ("nowhere", "host:", ":7447", "host:0", "host:65536", "host:seven"):
        done = type(cases)(cases.report, cases.bin_dir, server).call("status", "--json")
        cases.report.equal(f"--server {server}", done.returncode, 2)
        cases.typed(f"--server {server}", done.stderr, "invalid_argument", "HOST:PORT")


def odd_but_right_cases(cases, drives):
    for place in (["-3", "-4"], ["-.5", "-0"], ["-1e3", "+2"], ["5", "-2.5e-1"], ["--json", "-3", "-4"]):
        cases.report.equal(f"point {place}", list(cases.accepted(f"point {place}", ["point", *place])), ["layers"])
    cases.run("query", "--center", "-3,-4", "--radius", "5")
    cases.run("query", "--center=-3,-.5", "--radius=5")
    plan = cases.call("plan", "--from", "-500,-2,-1", "--to", "-510,-2,-1", "--json")
    cases.report.equal("plan between negative places", plan.returncode, 3)
    cases.report.equal("an open range", cases.run("ingest", drives.good, *NEAR, "--range", ":3")["keyframes"], 3)
    cases.report.equal("an empty range", cases.run("ingest", drives.good, "--range", "9:9")["keyframes"], 0)
    cases.report.equal("a folder with a slash behind",
                       cases.run("ingest", f"{drives.good}/", *NEAR)["duplicates"], 5)
    cases.report.equal("a flag before the command", cases.call("--json", "status").stdout[:1], "{")


def help_cases(cases):
    for line in ([], *([command] for command in USAGE), ["poses", "apply"], ["poses", "undo"], ["session", "retract"]):
        done = cases.call(*line, "--help")
        cases.report.equal(f"{line} --help: exit code", done.returncode, 0)
        cases.report.check(f"{line} --help: on stdout", "Usage: atlas" in done.stdout and not done.stderr,
                           done.stderr)
    version = cases.call("--version")
    cases.report.check("--version", version.returncode == 0 and version.stdout.startswith("atlas "), version)


def run(cases, source, work):
    drives = Drives(source, work)
    cases.run("ingest", drives.good, *NEAR)
    usage_cases(cases, drives)
    usage_before_the_daemon_cases(cases, drives)
    odd_but_right_cases(cases, drives)
    help_cases(cases)
