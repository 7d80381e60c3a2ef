#!/usr/bin/python3
"""The command line's contract: names, JSON keys, streams, and what goes to stdout and to stderr.
Usage: contract_test.py BIN_DIR DRIVE; DRIVE is a simulated street with labels."""

import json
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import threading

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))

import map_use_cases
from harness import NEAR, SMALL, Cases, Daemon, Drives, Report

KEYS = {
    "ingest": "keyframes acked duplicates sent_before reconnections metres bytes_sent frontend_ms_per_scan "
              "sensor_height_m sessions session_states wall_s",
    "wait": "revision dirty_tiles",
    "status": "revision preset keyframes sessions tiles dirty_tiles damaged_tiles store_bytes tile_bytes keyframe_bytes "
              "cells multilayer_cells rss_bytes compacted quarantined used_bytes store_limit_bytes disk_free_bytes "
              "disk_floor_bytes refusing",
    "point": "layers",
    "query": "type tiles bytes revision truncated",
    "poses": "updated tiles_marked revision batch compacted sessions",
    "sessions": "sessions",
    "session": "vehicle session state changed tiles_marked revision keyframes_deleted",
    "vehicle": "vehicle sessions changed tiles_marked revision",
    "watch": "type revision",
    "log": "events",
    "backup": "name bytes revision keyframes tiles digest",
    "backups": "backups",
    "restore": "backup_revision keyframes tiles bytes digest epoch revision kept",
    "compact": "dropped bytes tiles_checked horizon revision",
    "digest": "digest tiles revision",
    "verify": "checked damaged mismatched restored given_up",
    "segment": "precision recall f1 missed_curb false_road ms_per_scan scans",
    "localize": "type translation_rmse_m rotation_rmse_deg translation_p95_m failures lost restarts scans hz "
                "bytes_received",
    "plan": "found length_m cost searched_cost waypoints clearance_m slope_deg tiles_loaded expansions ms",
    "render": "width height metres_per_pixel",
    "export": "points",
    "simulate": "scans metres",
}
LAYER = "z_m sigma_m occupancy traversable measured observations confirmed column"
COLUMN = "base_m segment_m probabilities"
TILE = "type level x y revision bytes"
SCAN = "type scan pose health error_m error_deg"


def lines_of(cases, work, drive):
    correction = pathlib.Path(work) / "corrections.txt"
    correction.write_text("vehicle good 0 1 0 0 0.25 0 1 0 -1.6 0 0 1 1.8\n", encoding="ascii")
    return {
        "ingest": ["ingest", drive, *NEAR],
        "wait": ["wait"],
        "status": ["status"],
        "point": ["point", "1", "-1.6"],
        "query": ["query", "--center", "0,0", "--radius", "20", "-o", f"{work}/tiles"],
        "poses": ["poses", "apply", correction],
        "sessions": ["sessions"],
        "session": ["session", "restore", "vehicle/good"],
        "vehicle": ["vehicle", "restore", "vehicle"],
        "watch": ["watch", "--center", "0,0", "--radius", "20", "--for", "0.2"],
        "log": ["log"],
        "compact": ["compact", "--before", "1.5"],
        "digest": ["digest"],
        "verify": ["verify", "--rebuild"],
        "segment": ["segment", drive, "--curbs"],
        "localize": ["localize", drive, "--perturb", "0.2,1", "--trials", "2", "--max-range", "12"],
        "plan": ["plan", "--from", "0,-1.6,0", "--to", "4,-1.6,0"],
        "render": ["render", "-o", f"{work}/map.png"],
        "export": ["export", "--points", f"{work}/map.pcd"],
    }


def has_keys(cases, name, found, keys):
    missing = set(keys.split()) - set(found)
    cases.report.check(f"{name}: keys", not missing, f"without {sorted(missing)}: {found}")


def is_ratio(value):
    return value is None or 0 <= value <= 1


def objects(cases, name, done):
    cases.report.equal(f"{name}: exit code ({done.stderr.strip()})", done.returncode, 0)
    cases.report.equal(f"{name}: stderr", done.stderr, "")
    return [json.loads(line) for line in done.stdout.splitlines()]


def key_cases(cases, lines):
    found = {}
    for name, line in lines.items():
        plain = cases.call(*line)
        cases.report.equal(f"{name}: exit code without --json", plain.returncode, 0)
        cases.report.check(f"{name}: text on stdout alone", plain.stdout and not plain.stderr, plain)
        cases.report.check(f"{name}: text is no JSON", not plain.stdout.startswith("{"), plain.stdout)
        found[name] = objects(cases, name, cases.call(*line, "--json"))
        has_keys(cases, name, found[name][-1], KEYS[name])
        if name not in ("query", "localize"):
            cases.report.equal(f"{name}: objects", len(found[name]), 1)
    return found


def content_cases(cases, found):
    layers = found["point"][0]["layers"]
    cases.report.check("point: a layer", len(layers) > 0, found["point"])
    for layer in layers:
        has_keys(cases, "layer", layer, LAYER)
        has_keys(cases, "column", layer["column"], COLUMN)
        cases.report.check("layer: ratios", is_ratio(layer["occupancy"]) and
                           all(map(is_ratio, layer["column"]["probabilities"])), layer)
    cases.report.equal("point: lowest first", layers, sorted(layers, key=lambda layer: layer["z_m"]))
    cases.report.check("digest: hex", re.fullmatch("[0-9a-f]{64}", found["digest"][0]["digest"]), found["digest"])
    has_keys(cases, "event", found["log"][0]["events"][0], "id revision time_ms kind author subject detail")
    has_keys(cases, "session", found["sessions"][0]["sessions"][0], "vehicle session state keyframes compacted")
    cases.report.check("segment: ratios", all(is_ratio(found["segment"][0][key])
                                              for key in ("precision", "recall", "f1")), found["segment"])
    cases.report.check("plan: waypoints", all(len(p) == 3 for p in found["plan"][0]["waypoints"]), found["plan"])


def stream_cases(cases, found, work):
    *tiles, summary = found["query"]
    cases.report.equal("query: the last line", summary["type"], "summary")
    cases.report.equal("query: tiles", len(tiles), summary["tiles"])
    for tile in tiles:
        has_keys(cases, "tile", tile, TILE)
        file = pathlib.Path(work) / f"tiles/{tile['level']}_{tile['x']}_{tile['y']}.tile"
        cases.report.equal(f"{file.name}: bytes", file.stat().st_size, tile["bytes"])
    levels = [tile["level"] for tile in tiles]
    cases.report.equal("query: coarse to fine", levels, sorted(levels, reverse=True))
    *scans, summary = found["localize"]
    cases.report.equal("localize: the last line", summary["type"], "summary")
    cases.report.equal("localize: lines", len(scans), 2 * summary["scans"])
    for scan in scans:
        has_keys(cases, "scan", scan, SCAN)
        cases.report.check("scan: values", scan["type"] == "scan" and len(scan["pose"]) == 12 and
                           scan["health"] in ("good", "weak", "lost"), scan)


def track_cases(cases, work, drive):
    """What `localize` writes beside what it prints, by either method."""
    for mode in ("atlas", "paper"):
        for ending, fields, separator in (("csv", 24, ","), ("tum", 8, " "), ("kitti", 12, " ")):
            file, picture = pathlib.Path(work) / f"{mode}.{ending}", pathlib.Path(work) / f"{mode}.svg"
            found = cases.run("localize", drive, "--max-range", "12", "--mode", mode, "--output", file, "--plot",
                              picture)
            lines = file.read_text(encoding="ascii").splitlines()
            cases.report.equal(f"{file.name}: lines", len(lines), found["scans"] + (ending == "csv"))
            cases.report.equal(f"{file.name}: fields", {len(line.split(separator)) for line in lines}, {fields})
            cases.report.check(f"{picture.name}: a picture", picture.read_text(encoding="ascii").endswith("</svg>\n"))
        cases.report.equal(f"localize --mode {mode}: failures", found["failures"], 0)
    cases.run("localize", drive, "--max-range", "12", "--plot", f"{work}/track.png")
    cases.report.equal("track.png: a picture", pathlib.Path(work, "track.png").read_bytes()[:4], b"\x89PNG")


def contradiction_cases(cases, work, drive):
    """What `localize --contradictions` writes and `render` draws."""
    for ending in ("csv", "geojson"):
        file = pathlib.Path(work) / f"contradictions.{ending}"
        found = cases.run("localize", drive, "--max-range", "12", "--contradictions", file)["contradictions"]
        has_keys(cases, "contradictions", found, "appeared vanished moving scans ms_per_scan")
        text = file.read_text(encoding="ascii")
        count = len(text.splitlines()) - 1 if ending == "csv" else len(json.loads(text)["features"])
        cases.report.equal(f"{file.name}: contradictions", count, found["appeared"] + found["vanished"] + found["moving"])
        cases.run("render", "-o", f"{work}/contradictions.png", "--contradictions", file)


def export_cases(cases, work):
    """Of an area, and from a file: the same points."""
    area = ["--center", "0,0", "--radius", "8"]
    some = cases.run("export", "--points", f"{work}/some.ply", *area)["points"]
    every = cases.run("export", "--points", f"{work}/every.ply")["points"]
    cases.report.check("export: an area is less than all", 0 < some < every, (some, every))
    cases.run("backup", "export")
    copy = pathlib.Path(work) / "backups/export"
    done = subprocess.run([cases.bin_dir / "atlas", "export", "--points", f"{work}/file.ply", *area, "--atlas", copy],
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False)
    cases.report.equal("export --atlas: exit code", done.returncode, 0)
    read = [sorted(points_of(pathlib.Path(work) / f"{name}.ply")) for name in ("some", "file")]
    cases.report.equal("export --atlas: the same points", read[0], read[1])


def points_of(file):
    data = file.read_bytes()
    body = data[data.index(b"end_header\n") + len(b"end_header\n"):]
    return list(struct.iter_unpack("<dddf", body))


def backup_cases(cases, work):
    """Each line can be run once."""
    found = {}
    for name, plain, line in (
            ("backup", ["backup", "monday"], ["backup", "tuesday"]),
            ("backups", ["backups"], ["backups"]),
            ("restore", ["restore", f"{work}/backups/monday", "--to", f"{work}/plain/atlas.db"],
             ["restore", f"{work}/backups/tuesday", "--to", f"{work}/json/atlas.db"])):
        done = cases.call(*plain)
        cases.report.equal(f"{name}: exit code without --json ({done.stderr})", done.returncode, 0)
        cases.report.check(f"{name}: text on stdout alone", done.stdout and not done.stderr, done)
        [found[name]] = objects(cases, name, cases.call(*line, "--json"))
        has_keys(cases, name, found[name], KEYS[name])
    for line in found["backups"]["backups"]:
        has_keys(cases, "a line of backups", line, "name bytes time_ms")
    cases.report.equal("backup and restore: digest", found["restore"]["digest"], found["backup"]["digest"])
    for name, line, labels in (  # a copy may be done before anybody is told of it
            ("backup", ["backup", "wednesday"], ("copying", "reading back")),
            ("restore", ["restore", f"{work}/backups/monday", "--to", f"{work}/json/atlas.db", "--replace"],
             ("restoring",))):
        done, seen = on_terminal(cases, *line, "--json")
        cases.report.equal(f"{name} on a terminal: exit code", done.returncode, 0)
        is_seen = any("\r" + label in seen for label in labels)
        cases.report.check(f"{name} on a terminal: a bar, wiped at the end",
                           is_seen and seen.endswith("\r\x1b[K"), repr(seen[-80:]))


def unlabelled_case(cases, drives):
    folder = drives.copy("unlabelled")
    for label in (folder / "labels").iterdir():
        label.unlink()
    counts = cases.run("segment", folder)
    has_keys(cases, "segment without labels", counts, "ground obstacle ms_per_scan scans")
    cases.report.check("segment without labels: no score", "f1" not in counts, counts)


def on_terminal(cases, *args):
    """The command with a terminal for stderr: what it printed to stdout and to the terminal."""
    master, slave = os.openpty()
    seen = []

    def watch():
        try:
            while data := os.read(master, 65536):
                seen.append(data)
        except OSError:
            pass  # Linux ends a terminal with an error

    done = None
    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        done = cases.call(*args, stderr=slave)
    finally:
        os.close(slave)
        watcher.join()
        os.close(master)
    return done, b"".join(seen).decode()


def progress_cases(cases, lines, work):
    lines = {name: lines[name] for name in ("ingest", "segment", "localize")}
    lines["simulate"] = ["simulate", "street", "-o", f"{work}/simulated"]
    for name, line in lines.items():
        done, seen = on_terminal(cases, *line, "--json")
        cases.report.equal(f"{name} on a terminal: exit code", done.returncode, 0)
        cases.report.check(f"{name} on a terminal: a bar, wiped at the end",
                           "\r" + name in seen and "100 %" in seen and seen.endswith("\r\x1b[K"), repr(seen[-80:]))
        last = json.loads(done.stdout.splitlines()[-1])
        has_keys(cases, f"{name} on a terminal", last, KEYS[name])
    _, seen = on_terminal(cases, "ingest", f"{work}/nowhere")
    cases.report.check("a failure on a terminal: the message alone", seen.startswith("atlas: "), seen)


def help_cases(cases):
    text = cases.call("--help").stdout
    commands = re.findall(r"^  ([a-z]+) +\S", text.partition("Subcommands:")[2], re.M)
    cases.report.equal("--help: commands", sorted(commands), sorted(KEYS))
    for command in commands:
        page = cases.call(command, "--help").stdout
        cases.report.check(f"{command} --help: the exit codes", "6 invalid data" in page, page)
    daemon = subprocess.run([cases.bin_dir / "atlasd", "--help"], stdout=subprocess.PIPE, text=True, check=True)
    for flag in ("--data", "--listen", "--config", "--cell-size", "--segments", "--segment-height", "--preset"):
        cases.report.check(f"atlasd --help: {flag}", flag in daemon.stdout, daemon.stdout)
    for preset in ("strict", "bounded", "paper"):
        cases.report.check(f"atlasd --help: preset {preset}", preset in daemon.stdout, daemon.stdout)


def server_cases(cases):
    def status(*flags, **environment):
        return subprocess.run([cases.bin_dir / "atlas", "status", *flags], env={**os.environ, **environment},
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False).returncode

    cases.report.equal("ATLAS_SERVER", status(ATLAS_SERVER=cases.server), 0)
    cases.report.equal("--server before ATLAS_SERVER", status("--server", cases.server, ATLAS_SERVER="127.0.0.1:9"), 0)
    cases.report.equal("ATLAS_SERVER that is none", status(ATLAS_SERVER="nowhere"), 2)


def main():
    bin_dir, source = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    report = Report()
    with tempfile.TemporaryDirectory() as work:
        pathlib.Path(work, "backups").mkdir()
        flags = [*SMALL, "--preset", "bounded", "--backup-folder", work + "/backups"]
        with Daemon(bin_dir, work + "/atlas", *flags) as daemon:
            cases = Cases(report, bin_dir, daemon.server)
            drives = Drives(source, work + "/drives")
            lines = lines_of(cases, work, drives.good)
            found = key_cases(cases, lines)
            content_cases(cases, found)
            stream_cases(cases, found, work)
            track_cases(cases, work, drives.good)
            contradiction_cases(cases, work, drives.good)
            map_use_cases.run(cases, drives, work)
            export_cases(cases, work)
            backup_cases(cases, work)
            unlabelled_case(cases, drives)
            progress_cases(cases, lines, work)
            help_cases(cases)
            server_cases(cases)
        report.equal("the daemon's exit code after SIGTERM", daemon.process.returncode, 0)
    print(f"{report.checks} checks, {report.failed} failed")
    return 1 if report.failed else 0


if __name__ == "__main__":
    sys.exit(main())
