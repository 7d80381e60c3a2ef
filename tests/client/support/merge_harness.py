"""What the tests of `atlas-merge` share: drives whose poses drift, the program beside a daemon, and its log.

As a program it makes the drives: merge_harness.py BIN_DIR DRIVES."""

import json
import os
import pathlib
import pty
import shutil
import signal
import subprocess
import sys
import tempfile
import threading

from harness import EXIT, Cases, Daemon, Report

COARSE = ("--cell-size", "0.2")  # a daemon's flag: few cells, and all that a merge needs
NEAR = ("--max-range", "15")  # an ingest's
# One street twice, of which it takes a second to find out, and what it has nothing to do with.
DRIVES = {"first": ("street", "--seed", "0", "--range", "30:100", "--drift", "5"),
          "second": ("street", "--seed", "2", "--range", "30:100", "--drift", "6"),
          "third": ("street", "--seed", "4", "--range", "30:100", "--drift", "7"),
          "garage": ("garage", "--range", "70:100", "--drift", "3")}
PATIENCE_S = 120
signal.signal(signal.SIGINT, signal.SIG_DFL)  # in the background it is ignored, and by whatever is started there


def simulate(bin_dir, folder):
    """A folder a drive, made anew."""
    shutil.rmtree(folder, ignore_errors=True)
    for name, how in DRIVES.items():
        subprocess.run([bin_dir / "atlas", "simulate", *how, "-o", folder / name], check=True,
                       stdout=subprocess.DEVNULL)


class Merges(Cases):
    """`atlas-merge` and `atlas` against one daemon."""

    def __init__(self, report, bin_dir, server, drives):
        super().__init__(report, bin_dir, server)
        self.drives = drives

    def ingest(self, name, *flags, session="day"):
        return self.run("ingest", self.drives / name, *NEAR, "--vehicle", name, "--session", session, *flags)

    def staged(self, *names):
        for name in names:
            self.ingest(name, "--staged")

    def states(self):
        return {one["vehicle"]: one["state"] for one in self.run("sessions")["sessions"]}

    def command(self, *args):
        return [self.bin_dir / "atlas-merge", *map(str, args)]

    def merge(self, *args, server=True, **run):
        where = ("--server", self.server) if server else ()
        return subprocess.run(self.command(*args, *where), capture_output=True, text=True, timeout=PATIENCE_S,
                              check=False, **run)

    def merged(self, name, *args, server=True):
        """What a run that must succeed prints as JSON."""
        done = self.merge("run", *args, "--json", server=server)
        self.report.equal(f"{name}: exit code ({done.stderr.strip()})", done.returncode, 0)
        return json.loads(done.stdout) if done.returncode == 0 else {}

    def merge_refused(self, name, args, code, says="", server=True, **run):
        """Typed, on one stream, with and without --json; nothing is changed."""
        before = self.state()
        plain = self.merge(*args, server=server, **run)
        self.report.equal(f"{name}: exit code", plain.returncode, EXIT[code])
        self.report.check(f"{name}: message", "atlas-merge: " in plain.stderr and says in plain.stderr, plain.stderr)
        done = self.merge(*args, "--json", server=server, **run)
        self.report.equal(f"{name}: exit code with --json", done.returncode, EXIT[code])
        self.report.equal(f"{name}: stdout", plain.stdout + done.stdout, "")
        self.typed(name, done.stderr.splitlines()[-1] if done.stderr else "", code, says)
        self.report.equal(f"{name}: the atlas", self.state(), before)


class Watched:
    """A run whose steps are seen: on a terminal it draws a bar for each."""

    def __init__(self, merges, *args):
        terminal, slave = pty.openpty()
        self.terminal = os.fdopen(terminal, "rb", buffering=0)
        self.process = subprocess.Popen(merges.command(*args, "--server", merges.server), stdout=subprocess.PIPE,
                                        stderr=slave, text=True)
        os.close(slave)
        self.shown = b""

    def wait_for(self, step):
        """Until it says so; False where it ended before."""
        while step.encode() not in self.shown:
            try:
                more = self.terminal.read(4096)
            except OSError:  # the other end is closed
                return False
            if not more:
                return False
            self.shown += more
        return True

    def end(self):
        """Its exit code and stdout."""
        drain = threading.Thread(target=self.wait_for, args=("\0never",))  # a full terminal would stop it
        drain.start()
        out = self.process.communicate(timeout=PATIENCE_S)[0]
        drain.join()
        self.terminal.close()
        return self.process.returncode, out


class Service:
    """`atlas-merge serve`, and the events of its log."""

    def __init__(self, merges, *flags):
        command = merges.command("serve", "--json", "--settle", "1", "--every", "0.1",
                                 "--server", merges.server, *flags)
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.events = []
        self.watchdog = threading.Timer(PATIENCE_S, self.process.kill)
        self.watchdog.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop(signal.SIGKILL)
        self.process.stderr.close()

    def next(self):
        """None: it has ended."""
        line = self.process.stderr.readline()
        if not line:
            return None
        self.events.append(json.loads(line))
        return self.events[-1]

    def wait_for(self, *kinds):
        """The next event of these; None where it ends before."""
        while True:
            event = self.next()
            if event is None or event.get("event") in kinds:
                return event

    def of(self, kind):
        return [event for event in self.events if event.get("event") == kind]

    def stop(self, how=signal.SIGTERM):
        """Its exit code, as `end`."""
        if self.process.poll() is None:
            self.process.send_signal(how)
        return self.end()

    def end(self):
        """Its exit code when it has ended by itself; all that it said is in `events`."""
        while self.next() is not None:
            pass
        self.watchdog.cancel()
        return self.process.wait(timeout=60)


class Restartable:
    """A daemon that is killed and comes back on its port."""

    def __init__(self, bin_dir, data, *flags):
        self.start = lambda **run: Daemon(bin_dir, data, *flags, **run)
        self.daemon = self.start()

    def restart(self):
        server = self.daemon.server
        self.daemon.stop(signal.SIGKILL)
        self.daemon = self.start(listen=server)
        assert self.daemon.server == server, self.daemon.process.communicate()[1]


def run_group(groups):
    """The cases of the group that the command line asks for, BIN_DIR DRIVES GROUP; the exit code."""
    bin_dir, drives = (pathlib.Path(arg) for arg in sys.argv[1:3])
    report = Report()
    with tempfile.TemporaryDirectory() as name:
        work = pathlib.Path(name)
        work.chmod(0o755)  # commands that run as nobody reach it
        groups[sys.argv[3]](report, bin_dir, drives, work)
    print(f"{report.checks} checks, {report.failed} failed")
    return 1 if report.failed else 0


if __name__ == "__main__":
    simulate(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
