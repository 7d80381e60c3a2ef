"""The benchmarks of deploy/bench.sh on serving: the daemon against nginx with the same tiles as files.
Docs/results.md, "Serving"."""

import os
import pathlib
import signal
import socket
import statistics
import subprocess
import tempfile
import time

from bench_daemon import Atlas, rows_of

ROUNDS = 7
ROUND_MS = 1500
THREADS = 1  # of the daemon's network and of nginx; the load generator has a core of its own

NGINX = "nginx"  # the program

CONFIG = """daemon off;
{user}
pid {folder}/nginx.pid;
error_log {folder}/error.log;
worker_processes {threads};
events {{ worker_connections 4096; }}
http {{
  access_log off;
  sendfile on;
  tcp_nodelay on;
  tcp_nopush {nopush};
  open_file_cache max=200000 inactive=1h;
  open_file_cache_valid 1h;
  keepalive_timeout 1h;
  keepalive_requests 1000000000;
  default_type application/octet-stream;
  client_body_temp_path {folder}/body;
  proxy_temp_path {folder}/proxy;
  fastcgi_temp_path {folder}/fastcgi;
  uwsgi_temp_path {folder}/uwsgi;
  scgi_temp_path {folder}/scgi;
  server {{ listen 127.0.0.1:{port}; root {root}; }}
}}
"""


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Nginx:
    """Serves a folder, as fast as it can."""

    def __init__(self, root, nopush):
        self.folder = tempfile.TemporaryDirectory()
        self.port = free_port()
        config = pathlib.Path(self.folder.name) / "nginx.conf"
        config.write_text(CONFIG.format(folder=self.folder.name, port=self.port, root=root, threads=THREADS,
                                        nopush=nopush, user="user root;" if os.geteuid() == 0 else ""))
        pathlib.Path(self.folder.name).chmod(0o755)
        self.process = subprocess.Popen([NGINX, "-c", config, "-e", "stderr"])
        for _ in range(100):
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", self.port)) == 0:
                    return
            time.sleep(0.05)
        raise RuntimeError("nginx does not listen")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        self.process.wait()
        self.folder.cleanup()


def fill(atlas, drive):
    """Some thousand tiles of real and simulated drives."""
    for name in ("kitti_0005", "sim_garage_A", "sim_overpass_A", "sim_overpass_B"):
        atlas.run("ingest", drive(name), "--vehicle", "car", "--session", name)
    atlas.run("wait")


def median(rows, case, server, key):
    return statistics.median(row[key] for row in rows if row["case"] == case and row["server"] == server)


def paired(rows, case, against, key):
    """The median of the ratios of each round."""
    def of(server, name):
        return {row["round"]: row[key] for row in rows if row["case"] == name and row["server"] == server}
    ours, theirs = of("atlas", case), of("nginx", against)
    return statistics.median(ours[r] / theirs[r] for r in ours)


def bench_serving(bin_dir, emit, drive):
    """Requests for one tile at a time and for 64 at once, and what is held already, on 16 connections."""
    with Atlas(bin_dir, "--network-threads", str(THREADS)) as atlas, tempfile.TemporaryDirectory() as root:
        pathlib.Path(root).chmod(0o755)
        fill(atlas, drive)
        subprocess.run([bin_dir / "serving_bench", "files", atlas.server, root], check=True)
        with Nginx(root, "off") as nginx:
            rows = list(rows_of(bin_dir / "serving_bench", "run", atlas.server.rsplit(":")[-1], nginx.port, root,
                                ROUNDS, ROUND_MS))
    rows = [row for row in rows if row["round"] >= 0]
    for case, against, asked in (("single", "single", 0.8), ("pipelined", "pipelined", 1.5),
                                 ("not_modified", "not_modified_single", 3.0),
                                 ("not_modified", "not_modified", None)):
        emit(f"serving.{case}.tiles_per_s", median(rows, case, "atlas", "tiles_per_s"), "tiles/s",
             f"nginx, {against}" + (f", asked {asked}" if asked else ""),
             median(rows, case, "atlas", "tiles_per_s") / paired(rows, case, against, "tiles_per_s"))
    emit("serving.single.p99", median(rows, "single", "atlas", "batch_ms_p99"), "ms", "nginx, asked at most 2",
         median(rows, "single", "atlas", "batch_ms_p99") / paired(rows, "single", "single", "batch_ms_p99"))
    emit("serving.single.bandwidth", median(rows, "single", "atlas", "mib_per_s"), "MiB/s", "nginx",
         median(rows, "single", "nginx", "mib_per_s"))


BENCHMARKS = {"serving": bench_serving}
