"""A daemon for a benchmark, and the rows that programs print."""

import json
import pathlib
import subprocess
import sys
import tempfile
import threading
import urllib.request


def rows_of(*command):
    """Each JSON line as it comes."""
    process = subprocess.Popen([str(part) for part in command], stdout=subprocess.PIPE, text=True)
    for line in process.stdout:
        yield json.loads(line)
    if process.wait():
        sys.exit(process.returncode)


class Background:
    """What runs beside a block, on a thread of its own: `run`, until `is_over`."""

    def __init__(self, name):
        self.is_over = threading.Event()
        self.thread = threading.Thread(target=self.run, name=name)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.is_over.set()
        self.thread.join()


class Certificate:
    """One that vouches for itself, for 127.0.0.1."""

    def __init__(self, folder):
        self.file = pathlib.Path(folder) / "server.pem"
        self.key = pathlib.Path(folder) / "server.key"
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes",
                        "-days", "2", "-subj", "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1",
                        "-keyout", self.key, "-out", self.file], check=True, stderr=subprocess.DEVNULL)


class Atlas:
    """A daemon in a directory of its own, and the command line speaking to it."""

    def __init__(self, bin_dir, *flags, certificate=None, under=()):
        """`under`: a program that runs the daemon, and its arguments."""
        self.bin, self.under = bin_dir, under
        self.folder = tempfile.TemporaryDirectory()
        self.client_flags = []
        if certificate:
            flags += ("--tls-certificate", str(certificate.file), "--tls-key", str(certificate.key))
            self.client_flags = ["--tls-ca", certificate.file]
        self.start(*flags)

    def start(self, *flags):
        self.process = subprocess.Popen(
            [*self.under, self.bin / "atlasd", "--data", self.folder.name + "/atlas", "--listen", "127.0.0.1:0",
             "--http", "127.0.0.1:0", "--log-level", "error", *flags], stdout=subprocess.PIPE, text=True)
        self.server, self.http = (self.process.stdout.readline().split()[1] for _ in range(2))
        self.port = self.server.rsplit(":")[-1]

    def restart(self):
        """Stops in order and starts again, with default settings."""
        self.process.terminate()
        self.process.wait()
        self.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()
        self.folder.cleanup()

    @property
    def database(self):
        return pathlib.Path(self.folder.name) / "atlas/atlas.db"

    def kill(self):
        """As when the power of its machine goes, but for what the system has in its cache."""
        self.process.kill()
        self.process.wait()

    def stop(self):
        """Its exit code. Its files stay until the end."""
        self.process.terminate()
        return self.process.wait()

    def run(self, *args):
        out = subprocess.run([str(part) for part in (self.bin / "atlas", *args, "--server", self.server,
                                                     *self.client_flags, "--json")],
                             check=True, stdout=subprocess.PIPE, text=True).stdout
        return json.loads(out.strip().splitlines()[-1])

    def metrics(self):
        """The lines of the page: a name, with its labels, and a number."""
        with urllib.request.urlopen(f"http://{self.http}/metrics", timeout=10) as page:
            return [line for line in page.read().decode().splitlines() if not line.startswith("#")]

    def metric(self, name):
        """Of those without labels."""
        return next(float(line.split()[1]) for line in self.metrics() if line.startswith(name + " "))

    def refused_requests(self):
        """How many requests failed otherwise than by "not now", by kind and code."""
        requests = (line.split() for line in self.metrics() if line.startswith("roadatlas_requests_total{"))
        return {labels: int(float(count)) for labels, count in requests
                if not any(f'code="{code}"' in labels for code in ("ok", "unavailable", "resource_exhausted"))}

    def resident_bytes(self):
        lines = pathlib.Path(f"/proc/{self.process.pid}/status").read_text().splitlines()
        return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmRSS:"))
