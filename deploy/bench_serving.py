"""The benchmarks of deploy/bench.sh on serving: the daemon against nginx with the same tiles as files,
in the clear and with TLS. Docs/results.md, "Serving"."""

import contextlib
import pathlib
import statistics
import subprocess
import tempfile

from bench_daemon import Atlas, Certificate, rows_of
from bench_nginx import Nginx

ROUNDS = 7
ROUND_MS = 1500
THREADS = 1  # of the daemon's network and of nginx; the load generator has a core of its own
CONNECTIONS = 16
DRIVES = ("kitti_0005", "sim_garage_A", "sim_overpass_A", "sim_overpass_B")


def fill(atlas, drive):
    """Some hundred tiles of real and simulated drives."""
    for name in DRIVES:
        atlas.run("ingest", drive(name), "--vehicle", "car", "--session", name)
    atlas.run("wait")


def write_tile_files(bin_dir, atlas, folder, certificate=None):
    """What the load generator asks for."""
    pathlib.Path(folder).chmod(0o755)
    subprocess.run([bin_dir / "serving_bench", "files", atlas.server, folder,
                    *([certificate.file] if certificate else [])], check=True)


def median(rows, case, server, key):
    return statistics.median(row[key] for row in rows if row["case"] == case and row["server"] == server)


def paired(rows, case, against, key):
    """The median of the ratios of each round."""
    def of(server, name):
        return {row["round"]: row[key] for row in rows if row["case"] == name and row["server"] == server}
    ours, theirs = of("atlas", case), of("nginx", against)
    return statistics.median(ours[r] / theirs[r] for r in ours)


def rounds_of(bin_dir, drive, with_tls):
    """Rows of both servers, each case once a round."""
    with contextlib.ExitStack() as stack:
        root, keys = (stack.enter_context(tempfile.TemporaryDirectory()) for _ in range(2))
        certificate = Certificate(keys) if with_tls else None
        atlas = stack.enter_context(Atlas(bin_dir, "--network-threads", str(THREADS), certificate=certificate))
        fill(atlas, drive)
        write_tile_files(bin_dir, atlas, root, certificate)
        nginx = stack.enter_context(Nginx(root, THREADS, certificate))
        rows = rows_of(bin_dir / "serving_bench", "run", atlas.port, nginx.port, root, ROUNDS, ROUND_MS,
                       *(["tls"] if with_tls else []))
        return [row for row in rows if row["round"] >= 0]


def emit_against_nginx(emit, name, rows, cases):
    for case, against, asked in cases:
        emit(f"{name}.{case}.tiles_per_s", median(rows, case, "atlas", "tiles_per_s"), "tiles/s",
             f"nginx, {against}" + (f", asked {asked}" if asked else ""),
             median(rows, case, "atlas", "tiles_per_s") / paired(rows, case, against, "tiles_per_s"))
    emit(f"{name}.single.p99", median(rows, "single", "atlas", "batch_ms_p99"), "ms", "nginx, asked at most 2",
         median(rows, "single", "atlas", "batch_ms_p99") / paired(rows, "single", "single", "batch_ms_p99"))
    emit(f"{name}.single.bandwidth", median(rows, "single", "atlas", "mib_per_s"), "MiB/s", "nginx",
         median(rows, "single", "nginx", "mib_per_s"))


def bench_serving(bin_dir, emit, drive):
    """Requests for one tile at a time and for 64 at once, and what is held already, on 16 connections."""
    emit_against_nginx(emit, "serving", rounds_of(bin_dir, drive, with_tls=False),
                       (("single", "single", 0.8), ("pipelined", "pipelined", 1.5),
                        ("not_modified", "not_modified_single", 3.0), ("not_modified", "not_modified", None)))


def bench_serving_tls(bin_dir, emit, drive):
    """The same with TLS 1.3, one certificate and one cipher for both."""
    emit_against_nginx(emit, "serving_tls", rounds_of(bin_dir, drive, with_tls=True),
                       (("single", "single", 0.8), ("pipelined", "pipelined", 0.8),
                        ("not_modified", "not_modified_single", 0.8), ("not_modified", "not_modified", 0.8)))


BENCHMARKS = {"serving": bench_serving, "serving_tls": bench_serving_tls}
