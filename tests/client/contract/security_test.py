#!/usr/bin/python3
"""The commands of docs/daemon.md, "Who may come in", as they stand there, and what comes of them.

Usage: security_test.py BIN_DIR DRIVE DAEMON_MD."""

import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "support"))
from harness import NEAR, SMALL, Daemon, Report  # noqa: E402


def documented_commands(daemon_md):
    """The two blocks of the section, without the lines that start programs of ours."""
    section = re.search(r"## Who may come in\n(.*?)\n## ", daemon_md.read_text(encoding="utf-8"), re.S).group(1)
    lines = [line[4:] for line in section.splitlines() if line.startswith("    ")]
    ours = [line for line in lines if line.startswith(("atlasd ", "atlas "))]
    return "\n".join(line for line in lines if line not in ours), ours


class Shell:
    """`atlas` with what a documented line shows of itself, against the daemon at hand."""

    def __init__(self, bin_dir, folder, server):
        self.bin_dir, self.folder, self.server = bin_dir, folder, server

    def run(self, *args):
        name = ("--tls-name", "atlas.example") if "--tls-ca" in args else ()
        return subprocess.run([self.bin_dir / "atlas", *map(str, args), "--server", self.server, *name],
                              cwd=self.folder, capture_output=True, text=True, timeout=120)


def check_peers(report, shell, documented, drive):
    as_car, as_alice = ([word for word in line.split()[2:]] for line in documented)
    as_car, as_alice = as_car[2:], as_alice[2:]  # without --server ADDRESS
    as_merge = ["--tls-ca", "ca.pem", "--tls-certificate", "aligner.pem", "--tls-key", "aligner.key"]
    upload = ("ingest", drive, *NEAR, "--session", "s")
    for name, args, code, says in (
            ("a vehicle reads", ("status", *as_car), 0, ""),
            ("a person reads", ("status", *as_alice), 0, ""),
            ("nobody in particular stays outside", ("status", "--tls-ca", "ca.pem"), 1, "certificate or a token"),
            ("without TLS", ("status",), 5, ""),
            ("a daemon that nobody vouches for", ("status", "--tls-ca", "alone.pem"), 5, "certificate verify failed"),
            ("a file that is not there", ("status", "--tls-ca", "none.pem"), 2, "none.pem"),
            ("half a certificate", ("status", "--tls-ca", "ca.pem", "--tls-key", "car.7.key"), 2, "--tls-certificate"),
            ("a vehicle under another name", (*upload, "--vehicle", "car.8", *as_car), 1, "car.8"),
            ("a vehicle under its own", (*upload, "--vehicle", "car.7", *as_car), 0, ""),
            ("a vehicle retracts nothing", ("session", "retract", "car.7/s", *as_car), 1, "may not"),
            ("a merge uploads nothing", (*upload, "--vehicle", "aligner", *as_merge), 1, "may not"),
            ("a merge verifies", ("verify", *as_merge), 0, ""),
            ("an admin retracts", ("session", "retract", "car.7/s", *as_alice), 0, "")):
        done = shell.run(*args)
        report.check(name, done.returncode == code and says in done.stderr, (done.returncode, done.stderr))


def eventually(is_so):
    """Within ten seconds: a signal is not a call."""
    until = time.monotonic() + 10
    while not is_so():
        if time.monotonic() > until:
            return False
        time.sleep(0.05)
    return True


def check_changes(report, shell, daemon, documented):
    """Tokens and certificates are read again on SIGHUP; what is of no use changes nothing."""
    as_car, as_alice = documented[0].split()[4:], documented[1].split()[4:]

    def code(*args):
        return shell.run("status", *args).returncode
    tokens = shell.folder / "tokens"
    before = tokens.read_text(encoding="utf-8")
    tokens.write_text("alice boss never 00\n", encoding="utf-8")
    daemon.process.send_signal(signal.SIGHUP)
    report.check("tokens of no use change nothing", code(*as_alice) == 0)
    tokens.unlink()
    tokens.symlink_to(tokens.name)  # to itself: it cannot even be looked at
    daemon.process.send_signal(signal.SIGHUP)
    time.sleep(0.3)
    report.check("tokens that cannot be read change nothing", code(*as_alice) == 0 and daemon.process.poll() is None)
    tokens.unlink()
    tokens.write_text("", encoding="utf-8")
    daemon.process.send_signal(signal.SIGHUP)
    report.check("a token that was taken back opens nothing", eventually(lambda: code(*as_alice) == 1))
    report.equal("certificates count as before", code(*as_car), 0)
    tokens.write_text(before, encoding="utf-8")
    daemon.process.send_signal(signal.SIGHUP)
    report.check("a token that was given back opens", eventually(lambda: code(*as_alice) == 0))


def main():
    bin_dir, drive, daemon_md = (pathlib.Path(arg).resolve() for arg in sys.argv[1:4])
    report = Report()
    commands, ours = documented_commands(daemon_md)
    report.equal("documented: a daemon, a vehicle, a person", [line.split()[0] for line in ours],
                 ["atlasd", "atlas", "atlas"])
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        made = subprocess.run(["bash", "-e"], input=commands, cwd=folder, capture_output=True, text=True)
        report.equal("the documented commands", made.returncode, 0)
        subprocess.run(["bash", "-e"], input="openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes "
                       "-subj /CN=alone -keyout alone.key -out alone.pem 2>/dev/null", cwd=folder, text=True)
        flags = ours[0].split()
        tls = [folder / word if word.endswith((".pem", ".key")) else word
               for word in flags[flags.index("--tls-certificate"):]]
        with Daemon(bin_dir, folder / "data", *SMALL, *tls, "--tokens", folder / "tokens") as daemon:
            shell = Shell(bin_dir, folder, daemon.server)
            check_peers(report, shell, ours[1:], drive)
            check_changes(report, shell, daemon, ours[1:])
    print(f"{report.checks} checks, {report.failed} failed")
    return 1 if report.failed else 0


if __name__ == "__main__":
    sys.exit(main())
