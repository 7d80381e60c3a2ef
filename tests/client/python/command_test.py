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
