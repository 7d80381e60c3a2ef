"""What the cases share: a daemon, the command line, a small drive, and checks that are counted."""

import http.client
import json
import os
import pathlib
import shutil
import signal
import subprocess

NOBODY = 65534
SMALL = ("--cell-size", "0.2")  # a daemon's flags: few cells, quick to fuse
NEAR = ("--max-range", "12", "--every", "0")  # an ingest's flags: the same
EXIT = {"invalid_argument": 2, "not_found": 3, "conflict": 4, "unavailable": 5, "timeout": 5,
        "invalid_data": 6, "resource_exhausted": 1, "unsupported": 1, "permission_denied": 1, "internal": 1}


def unprivileged(bin_dir):
    """How commands run that file permissions shall bind: root is nobody then; None where nobody may not."""
    if os.geteuid() != 0:
        return {}
    nobody = {"user": NOBODY, "group": NOBODY, "extra_groups": []}
    try:
        subprocess.run([bin_dir / "atlas", "--version"], stdout=subprocess.DEVNULL, check=True, **nobody)
    except OSError:
        return None
    return nobody


class Report:
    """Counts checks and prints those that fail; a skip says why."""

    def __init__(self):
        self.checks = 0
        self.failed = 0

    def check(self, name, is_right, found=""):
        self.checks += 1
        if not is_right:
            self.failed += 1
            print(f"FAILED {name}: {str(found)[:600]}", flush=True)

    def equal(self, name, found, expected):
        self.check(name, found == expected, f"{found!r}, expected {expected!r}")

    @staticmethod
    def skip(name, reason):
        print(f"skipped {name}: {reason}", flush=True)


class Daemon:
    """`atlasd` on a free port, or on one of its own; leaves nothing running however the block ends."""

    def __init__(self, bin_dir, data, *flags, listen="127.0.0.1:0", **popen):
        self.process = subprocess.Popen(
            [bin_dir / "atlasd", "--data", str(data), "--listen", listen, "--log-level", "error",
             *flags], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **popen)
        line = self.process.stdout.readline().split()
        self.server = line[1] if line[:1] == ["listening"] else None
        self.http = self.process.stdout.readline().split()[1] if self.server and "--http" in flags else None

    def __enter__(self):
        assert self.server, f"the daemon did not start: {self.process.communicate()[1]}"
        return self

    def __exit__(self, *_):
        self.stop()

    def is_ready(self):
        """Whether it says so, and what else it says; a daemon with `--http`."""
        connection = http.client.HTTPConnection(self.http, timeout=30)
        connection.request("GET", "/readyz")
        reply = connection.getresponse()
        return reply.status == 200, reply.read().decode()

    def stop(self, how=signal.SIGTERM):
        """Its exit code; what it printed is in `err`."""
        if self.process.poll() is None:
            self.process.send_signal(how)
        self.err = self.process.communicate(timeout=60)[1]
        return self.process.returncode


class Cases:
    """The command line against one daemon. Every refusal leaves the atlas as it was."""

    def __init__(self, report, bin_dir, server):
        self.report = report
        self.bin_dir = bin_dir
        self.server = server
        self.unprivileged = unprivileged(bin_dir)

    def call(self, *args, **run):
        command = [self.bin_dir / "atlas", *map(str, args), "--server", self.server]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        return subprocess.run(command, text=True, check=False, **{**pipes, **run})

    def run(self, *args):
        """The last JSON line of a command that must succeed."""
        done = self.call(*args, "--json")
        assert done.returncode == 0, f"{args}: exit {done.returncode}: {done.stderr}"
        return json.loads(done.stdout.splitlines()[-1])

    def state(self):
        """Everything a refused command must not change; says too that the daemon serves."""
        return self.run("digest"), self.run("sessions")

    def refused(self, name, args, code, says="", is_stream=False, reason=None, **run):
        """`args` are refused as `refused_line` says, and leave the atlas as it was."""
        before = self.state()
        done = self.refused_line(name, args, code, says, is_stream, reason, **run)
        self.report.equal(f"{name}: the atlas", self.state(), before)
        return done

    def refused_line(self, name, args, code, says="", is_stream=False, reason=None, **run):
        """`args` fail with `code` and a message that holds `says`, with and without --json; what they print.

        A stream may have begun; it has no summary then. `reason`: what the JSON says beside the code.
        """
        plain = self.call(*args, **run)
        self.report.equal(f"{name}: exit code", plain.returncode, EXIT[code])
        self.report.check(f"{name}: message", plain.stderr.startswith("atlas: ") and says in plain.stderr,
                          plain.stderr)
        done = self.call(*args, "--json", **run)
        self.report.equal(f"{name}: exit code with --json", done.returncode, EXIT[code])
        self.report.check(f"{name}: stdout", "summary" not in done.stdout if is_stream else not done.stdout,
                          done.stdout)
        self.typed(name, done.stderr, code, says, reason)
        return done

    def forbidden(self, name, args, says, is_stream=False):
        """Refused by the disk, whoever runs this test."""
        if self.unprivileged is None:
            self.report.skip(name, f"nobody may not run what is in {self.bin_dir}")
            return
        self.refused(name, args, "permission_denied", says, is_stream, **self.unprivileged)

    def typed(self, name, stderr, code, says, reason=None):
        """One line {"error": {"code", "message"}} and nothing else; with `reason` that as well."""
        try:
            error = json.loads(stderr)["error"]
        except (ValueError, KeyError):
            self.report.check(f"{name}: JSON error", False, stderr)
            return
        self.report.equal(f"{name}: keys", sorted(error), ["code", "message"] + (["reason"] if reason else []))
        self.report.equal(f"{name}: reason", error.get("reason"), reason)
        self.report.equal(f"{name}: code", error["code"], code)
        self.report.check(f"{name}: JSON message", says in error["message"], error["message"])

    def accepted(self, name, args):
        done = self.call(*args, "--json")
        self.report.equal(f"{name}: exit code ({done.stderr.strip()})", done.returncode, 0)
        return json.loads(done.stdout.splitlines()[-1]) if done.returncode == 0 else {}


class Drives:
    """Copies of a small drive, each to be spoiled in its own way."""

    def __init__(self, source, folder, scans=5):
        self.folder = pathlib.Path(folder)
        self.good = self.folder / "good"
        for name in ("velodyne", "labels"):
            (self.good / name).mkdir(parents=True)
        for i in range(scans):
            shutil.copy(source / f"velodyne/{i:06}.bin", self.good / "velodyne")
            shutil.copy(source / f"labels/{i:06}.label", self.good / "labels")
        for name in ("poses.txt", "times.txt"):
            lines = (source / name).read_text(encoding="ascii").splitlines(keepends=True)
            (self.good / name).write_text("".join(lines[:scans]), encoding="ascii")

    def copy(self, name):
        return pathlib.Path(shutil.copytree(self.good, self.folder / name))

    def poses(self):
        return (self.good / "poses.txt").read_text(encoding="ascii").splitlines()


