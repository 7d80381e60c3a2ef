"""Good commands that the atlas refuses: corrections, conflicts, another profile, places without a map, targets
that cannot be written, a daemon that is not there."""

import pathlib
import socket
import threading

from harness import NEAR, SMALL, Daemon, Drives

IDENTITY = "1 0 0 {x} 0 1 0 {y} 0 0 1 {z}"


def correction(key, x=1.0, y=-1.6, z=1.8):
    return f"{key} " + IDENTITY.format(x=x, y=y, z=z)


REFUSED_LINES = {  # each on line 3, behind a good one
    "eleven numbers": "vehicle good 1 1 0 0 0 0 1 0 0 0 0 1",
    "thirteen numbers": correction("vehicle good 1") + " 7",
    "a word for a number": "vehicle good 1 1 0 0 here 0 1 0 0 0 0 1 0",
    "a word for the sequence": correction("vehicle good first"),
    "a negative sequence": correction("vehicle good -1"),
    "a sequence of 64 bits": correction("vehicle good 18446744073709551616"),
    "a name that is none": correction("vehi/cle good 1"),
    "a name too long": correction("vehicle " + "x" * 65 + " 1"),
    "NaN": "vehicle good 1 1 0 0 nan 0 1 0 0 0 0 1 0",
    "a scaled rotation": "vehicle good 1 2 0 0 0 0 2 0 0 0 0 2 0",
    "a reflection": "vehicle good 1 1 0 0 0 0 1 0 0 0 0 -1 0",
    "a pose 1e12 m away": correction("vehicle good 1", x=1e12),
    "a pose 100 km down": correction("vehicle good 1", z=-1e5),
    "a keyframe named twice": correction("vehicle good 0", x=2.0),
    "bytes that are no text": "\x00\x01\x02",
}


def correction_cases(cases, drives):
    file = drives.folder / "corrections.txt"

    def apply(*lines):
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return ["poses", "apply", file]

    good = correction("vehicle good 0", x=0.5)
    for name, line in REFUSED_LINES.items():
        cases.refused(f"poses apply, {name}", apply("# moved", good, line), "invalid_data", "line 3")
    cases.refused("poses apply, tilted against its keyframe",
                  apply(good, "vehicle good 1 1 0 0 1 0 0 -1 -1.6 0 1 0 1.8"), "invalid_data", "vehicle/good/1")
    for key in ("vehicle good 99", "vehicle other 0", "car good 0"):
        cases.refused(f"poses apply, unknown {key}", apply(good, correction(key)), "not_found",
                      key.replace(" ", "/"))
    cases.refused("poses apply, an empty file", apply(""), "invalid_data", "no pose")
    cases.refused("poses apply, no file", ["poses", "apply", drives.folder / "nowhere"], "not_found", "nowhere")
    cases.refused("poses apply, a folder", ["poses", "apply", drives.good], "invalid_data", "good")
    apply(good)
    file.chmod(0)
    cases.forbidden("poses apply, unreadable", ["poses", "apply", file], "corrections.txt")
    file.chmod(0o644)
    done = cases.accepted("poses apply, at last", ["poses", "apply", file])
    cases.report.equal("poses apply, at last: updated", done.get("updated"), 1)
    cases.report.equal("poses apply again", cases.run("poses", "apply", file)["updated"], 0)


def upload_cases(cases, drives):
    before = cases.state()
    again = cases.accepted("ingest again", ["ingest", drives.good, *NEAR])
    cases.report.equal("ingest again", [again.get(key) for key in ("keyframes", "acked", "duplicates")], [5, 5, 5])
    cases.report.equal("ingest again: the atlas", cases.state(), before)
    cases.refused("ingest, other content", ["ingest", drives.good, *NEAR, "--sensor-height", "1.6"], "conflict",
                  "vehicle/good/")
    cases.refused("ingest, other time", ["ingest", drives.good, *NEAR, "--start", "7"], "conflict", "vehicle/good/")
    cases.refused("ingest, a time to come", ["ingest", drives.good, *NEAR, "--start", "1e11", "--session", "new"],
                  "invalid_data", "time")
    cases.refused("ingest, a time before 1970", ["ingest", drives.good, *NEAR, "--start", "-0.5", "--session",
                                                 "new"], "invalid_data", "scan 0")


def read_frame(stream):
    header = stream.read(12)  # magic, length, checksum (docs/protocol.md)
    return header + stream.read(int.from_bytes(header[4:8], "little")) if len(header) == 12 else b""


def address(server):
    host, _, port = server.rpartition(":")
    return host, int(port)


class Impostor:
    """Shows clients the handshake of one daemon and hands all else to another."""

    def __init__(self, shown, real):
        self.shown, self.real = address(shown), address(real)
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.server = f"127.0.0.1:{self.listener.getsockname()[1]}"
        threading.Thread(target=self.serve, daemon=True).start()

    def serve(self):
        while True:
            try:
                client = self.listener.accept()[0]
            except OSError:  # closed
                return
            threading.Thread(target=self.relay, args=(client,), daemon=True).start()

    def relay(self, client):
        with client, socket.create_connection(self.shown) as shown, socket.create_connection(self.real) as real:
            requests = client.makefile("rb")
            hello = read_frame(requests)
            for daemon in (shown, real):
                daemon.sendall(hello)
            client.sendall(read_frame(shown.makefile("rb")))
            replies = real.makefile("rb")
            read_frame(replies)
            threading.Thread(target=self.copy, args=(replies, client), daemon=True).start()
            self.copy(requests, real)

    @staticmethod
    def copy(source, target):
        try:
            while frame := read_frame(source):
                target.sendall(frame)
            target.shutdown(socket.SHUT_WR)
        except OSError:
            pass  # the other side is gone, and so is this one soon

    def close(self):
        self.listener.close()


def other_profile_case(cases, drives, work):
    with Daemon(cases.bin_dir, work + "/other_profile", *SMALL, "--segment-height", "0.5") as other:
        impostor = Impostor(other.server, cases.server)
        before = cases.state()
        masked = type(cases)(cases.report, cases.bin_dir, impostor.server)
        done = masked.call("ingest", drives.good, *NEAR, "--session", "other", "--json")
        impostor.close()
        cases.report.equal("a keyframe of another profile: exit code", done.returncode, 6)
        cases.typed("a keyframe of another profile", done.stderr, "invalid_data", "vehicle/other/")
        cases.report.equal("a keyframe of another profile: the atlas", cases.state(), before)


def place_cases(cases):
    for name, ends in {"no route": ("0,-1.6,0", "0,500,0"), "off the map": ("900,900,0", "910,900,0")}.items():
        before = cases.state()
        done = cases.call("plan", "--from", ends[0], "--to", ends[1], "--json")
        cases.report.equal(f"plan, {name}: exit code", done.returncode, 3)
        cases.report.check(f"plan, {name}: found is false", '"found":false' in done.stdout, done.stdout)
        cases.typed(f"plan, {name}", done.stderr, "not_found", "")
        cases.report.equal(f"plan, {name}: the atlas", cases.state(), before)
    cases.report.equal("point off the map", cases.run("point", "9000", "-9000"), {"layers": []})
    cases.report.equal("query off the map",
                       cases.run("query", "--center", "9000,-9000", "--radius", "1")["tiles"], 0)


def target_cases(cases, drives, work):
    closed = pathlib.Path(work) / "closed"
    closed.mkdir(mode=0o555)
    near = ["--center", "0,0", "--radius", "5"]
    file = drives.good / "poses.txt"
    cases.refused("render into a missing folder", ["render", "-o", closed / "nowhere/map.png"], "not_found",
                  "nowhere")
    cases.refused("no route into a missing folder",
                  ["plan", "--from", "900,900,0", "--to", "910,900,0", "-o", closed / "nowhere/route.csv"],
                  "not_found", "nowhere")
    picture = drives.folder / "folder.png"
    picture.mkdir()
    cases.refused("render over a folder", ["render", "-o", picture], "conflict", "folder.png")
    cases.refused("render into a file", ["render", "-o", file / "map.png"], "conflict", "map.png")
    cases.forbidden("render into a closed folder", ["render", "-o", closed / "map.png"], "map.png")
    for line in (["localize", drives.good, "--output"], ["localize", drives.good, "--plot"],
                 ["localize", drives.good, "--contradictions"], ["export", "--points"]):
        ending = {"--output": "csv", "--plot": "svg", "--contradictions": "geojson", "--points": "ply"}[line[-1]]
        cases.refused(f"{line[-1]} into a missing folder", [*line, closed / f"nowhere/map.{ending}"], "not_found",
                      "nowhere")
        cases.refused(f"{line[-1]} into a file", [*line, file / f"map.{ending}"], "conflict", f"map.{ending}")
        folder = drives.folder / f"folder.{ending}"
        folder.mkdir()
        cases.refused(f"{line[-1]} over a folder", [*line, folder], "conflict", f"folder.{ending}")
        cases.forbidden(f"{line[-1]} into a closed folder", [*line, closed / f"map.{ending}"], f"map.{ending}")
    cases.refused("render contradictions that are none", ["render", "-o", drives.folder / "x.png", "--contradictions",
                                                          drives.folder / "none.csv"], "not_found", "none.csv")
    poses = drives.folder / "poses.csv"
    poses.write_bytes(file.read_bytes())
    cases.refused("render poses as contradictions", ["render", "-o", drives.folder / "x.png", "--contradictions", poses],
                  "invalid_data", "poses.csv")
    elsewhere = drives.folder / "elsewhere.csv"
    elsewhere.write_text("kind,x_m,y_m,layer_m,low_m,high_m,hits,passes,first_scan,last_scan,score\n"
                         "appeared,9000.100,0.100,0.000,0.000,1.000,3,0,1,3,9.00\n", encoding="ascii")
    cases.refused("render what contradicts another map", ["render", "-o", drives.folder / "x.png", "--contradictions",
                                                          elsewhere], "conflict", "elsewhere.csv")
    cases.refused("export where nothing is", ["export", "--points", drives.folder / "far.pcd", "--center", "9000,0",
                                              "--radius", "1"], "not_found", "nothing to export")
    cases.refused("query into a file", ["query", *near, "-o", file], "conflict", "poses.txt", is_stream=True)
    cases.forbidden("query into a closed folder", ["query", *near, "-o", closed / "tiles"], "tiles", is_stream=True)
    cases.refused("simulate over a drive", ["simulate", "street", "-o", drives.good], "conflict", "good")
    cases.forbidden("simulate into a closed folder", ["simulate", "street", "-o", closed / "drive"], "drive")
    left = [path for path in drives.folder.rglob("*.partial*")] + list(closed.iterdir())
    cases.report.equal("nothing half-written", left, [])
    full = pathlib.Path("/dev/full")
    if full.exists():
        with full.open("w", encoding="ascii") as stdout:
            done = cases.call("status", "--json", stdout=stdout)
        cases.report.equal("stdout on a full disk", done.returncode, 1)
        cases.typed("stdout on a full disk", done.stderr, "internal", "standard output")


def without_daemon_cases(cases, drives):
    listener = socket.create_server(("127.0.0.1", 0))
    gone = type(cases)(cases.report, cases.bin_dir, f"127.0.0.1:{listener.getsockname()[1]}")
    listener.close()
    for line in (["ingest", drives.good], ["wait"], ["status"], ["point", "0", "0"],
                 ["query", "--center", "0,0", "--radius", "5"], ["sessions"], ["digest"], ["verify"],
                 ["session", "retract", "vehicle/good"], ["compact", "--before", "1"], ["digest", "--at", "1"], ["point", "0", "0", "--at", "1"],
                 ["localize", drives.good], ["plan", "--from", "0,0,0", "--to", "1,0,0"],
                 ["render", "-o", drives.folder / "never.png"]):
        done = gone.call(*line, "--json")
        cases.report.equal(f"{line[0]} without a daemon: exit code", done.returncode, 5)
        cases.report.equal(f"{line[0]} without a daemon: stdout", done.stdout, "")
        cases.typed(f"{line[0]} without a daemon", done.stderr, "unavailable", gone.server)


def empty_atlas_cases(cases, drives, work):
    with Daemon(cases.bin_dir, work + "/empty", *SMALL) as daemon:
        empty = type(cases)(cases.report, cases.bin_dir, daemon.server)
        empty.refused("render an empty atlas", ["render", "-o", drives.folder / "empty.png"], "not_found", "empty")
        cases.report.check("no picture of an empty atlas", not (drives.folder / "empty.png").exists())
        empty.refused("export an empty atlas", ["export", "--points", drives.folder / "empty.pcd"], "not_found",
                      "nothing to export")
        cases.report.equal("digest of an empty atlas", empty.run("digest")["tiles"], 0)
        # Told before a scan is read: a damaged one would be another error.
        damaged = drives.copy("for_an_empty_atlas")
        (damaged / "velodyne/000000.bin").write_bytes(b"")
        for flags in ([], ["--relocalize"], ["--mode", "paper"], ["--perturb", "1,1"]):
            empty.refused(f"localize {flags} in an empty atlas", ["localize", damaged, *flags], "not_found",
                          "atlas ingest DRIVE")
        empty.run("ingest", drives.good, *NEAR, "--staged")
        empty.refused("localize in an atlas of staged sessions", ["localize", damaged], "not_found",
                      "1 staged (atlas session publish")


def run(cases, source, work):
    drives = Drives(source, work)
    cases.run("ingest", drives.good, *NEAR)
    upload_cases(cases, drives)
    correction_cases(cases, drives)
    other_profile_case(cases, drives, work)
    cases.refused("compact an atlas of preset strict", ["compact", "--before", "1"], "invalid_argument", "bounded")
    place_cases(cases)
    target_cases(cases, drives, work)
    without_daemon_cases(cases, drives)
    empty_atlas_cases(cases, drives, work)
