"""A daemon for a benchmark, and the rows that programs print."""

import json
import subprocess
import sys
import tempfile


def rows_of(*command):
    """Each JSON line as it comes."""
    process = subprocess.Popen([str(part) for part in command], stdout=subprocess.PIPE, text=True)
    for line in process.stdout:
        yield json.loads(line)
    if process.wait():
        sys.exit(process.returncode)


class Atlas:
    """A daemon in a directory of its own, and the command line speaking to it."""

    def __init__(self, bin_dir, *profile):
        self.bin = bin_dir
        self.folder = tempfile.TemporaryDirectory()
        self.start(*profile)

    def start(self, *flags):
        self.process = subprocess.Popen(
            [self.bin / "atlasd", "--data", self.folder.name + "/atlas", "--listen", "127.0.0.1:0",
             "--log-level", "error", *flags], stdout=subprocess.PIPE, text=True)
        self.server = self.process.stdout.readline().split()[1]

    def restart(self):
        """Stops in order and starts again, with default settings."""
        self.process.terminate()
        self.process.wait()
        self.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()
        self.folder.cleanup()

    def run(self, *args):
        out = subprocess.run([self.bin / "atlas", *map(str, args), "--server", self.server, "--json"],
                             check=True, stdout=subprocess.PIPE, text=True).stdout
        return json.loads(out.strip().splitlines()[-1])
