"""nginx over a folder of tiles, for the benchmarks on serving."""

import os
import pathlib
import signal
import socket
import subprocess
import tempfile
import time

PROGRAM = "nginx"

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
  tcp_nopush off;
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
  {tls}
  server {{ listen 127.0.0.1:{port}{ssl}; root {root}; }}
}}
"""

TLS = """ssl_protocols TLSv1.3;
  ssl_certificate {certificate.file};
  ssl_certificate_key {certificate.key};"""


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Nginx:
    """Serves a folder, as fast as it can."""

    def __init__(self, root, threads, certificate=None):
        self.folder = tempfile.TemporaryDirectory()
        self.port = free_port()
        config = pathlib.Path(self.folder.name) / "nginx.conf"
        config.write_text(CONFIG.format(
            folder=self.folder.name, port=self.port, root=root, threads=threads,
            user="user root;" if os.geteuid() == 0 else "", ssl=" ssl" if certificate else "",
            tls=TLS.format(certificate=certificate) if certificate else ""))
        pathlib.Path(self.folder.name).chmod(0o755)
        self.process = subprocess.Popen([PROGRAM, "-c", config, "-e", "stderr"])
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
