#!/usr/bin/python3
"""`python3 -m roadatlas` as docs/python.md shows it."""

import pathlib
import signal
import subprocess
import sys
import tempfile
import unittest

from roadatlas import geometry
from support import AtlasCase


class CommandTest(AtlasCase):

    def run_command(self, *arguments, server=None):
        return subprocess.run([sys.executable, "-B", "-m", "roadatlas", "--server", server or self.daemon.server,
                               *map(str, arguments)], capture_output=True, text=True, check=False)

    def test_status(self):
        self.client.upload_keyframe(self.upload(0, 0))
        done = self.run_command("status")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertRegex(done.stdout, r"\nkeyframes +1\n")

    def test_sync_writes_the_tiles(self):
        self.drive()
        out = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory())) / "tiles"
        done = self.run_command("sync", "--disc", 150, 0, 500, "--out", out)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        found = {path.name: path.read_bytes() for path in out.iterdir()}
        self.assertEqual(found, {"_".join(map(str, geometry.tile_place(key))) + ".tile": tile.blob
                                 for key, tile in self.map_now().items()})
        self.assertIn(f"{len(found)} tiles, ", done.stdout)

    def test_watch_tells_what_changes(self):
        watching = subprocess.Popen([sys.executable, "-B", "-m", "roadatlas", "watch", "--server", self.daemon.server,
                                     "--disc", "0", "0", "50", "--interval", "0.05"], stdout=subprocess.PIPE,
                                    stderr=subprocess.PIPE, text=True)
        try:
            self.assertEqual(watching.stdout.readline(), "from revision 0 on\n")
            self.client.upload_keyframe(self.upload(0, 0))
            self.assertRegex(watching.stdout.readline(), r"^revision \d+: changed \d+/-?\d+/-?\d+\n$")
            watching.send_signal(signal.SIGINT)
            self.assertEqual((watching.wait(60), watching.stderr.read()), (130, ""))
        finally:
            watching.kill()
            watching.communicate()

    def test_watch_ends_when_its_time_is_over(self):
        done = self.run_command("watch", "--disc", 0, 0, 50, "--seconds", 0.2)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "from revision 0 on\n", ""))

    def test_wrong_numbers_are_wrong_usage(self):
        out = self.enterContext(tempfile.TemporaryDirectory())
        disc = ("--disc", 0, 0, 5)
        for words in (("--disc", 0, 0, -5), ("--disc", 2e7, 0, 5), ("--disc", "nan", 0, 5), ("--disc", 0, "inf", 5),
                      ("--disc", 0, 0, "1e300"), ("--disc", "1e300", 0, 5), ("--disc", 0, "-1e300", 5),
                      ("--disc", 0, 0, "x"), ("--disc", 0, 0), (*disc, "--sections", -3), (*disc, "--sections", 1.5),
                      (*disc, "--budget", -1), (*disc, "--budget", 1 << 64), (*disc, "--finest", -1)):
            self.wrong("sync", "--out", out, *words)
        for words in (("--interval", "nan"), ("--interval", -1), ("--interval", "1e300"), ("--seconds", "nan"),
                      ("--seconds", "inf"), ("--seconds", -1)):
            self.wrong("watch", *disc, *words)
        for server in ("127.0.0.1:0", "127.0.0.1:65536", "127.0.0.1:\u00b2"):
            self.wrong("status", server=server)

    def wrong(self, *words, server=None):
        done = self.run_command(*words, server=server)
        self.assertEqual((done.returncode, done.stdout), (2, ""), (words, done.stderr))
        self.assertRegex(done.stderr, r"\Aroadatlas: .+\n\Z")

    def test_failures_say_why(self):
        out = self.enterContext(tempfile.TemporaryDirectory())
        refused = self.run_command("sync", "--disc", 0, 0, 5, "--out", out, "--finest", 99)
        self.assertEqual((refused.returncode, refused.stdout), (1, ""))
        self.assertRegex(refused.stderr, "^roadatlas: invalid_argument: ")
        self.daemon.stop()
        for server, code in ((None, 1), ("nowhere", 2)):
            done = self.run_command("status", server=server)
            self.assertEqual((done.returncode, done.stdout), (code, ""))
            self.assertRegex(done.stderr, "^roadatlas: ")


if __name__ == "__main__":
    unittest.main()
