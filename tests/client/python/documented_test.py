#!/usr/bin/python3
"""The examples of docs/python.md, as they stand there but for the port, against a real daemon."""

import contextlib
import io
import os
import re
import threading
import unittest

from fleet import FleetCase
from support import ROOT, AtlasCase

PAGE = (ROOT / "docs/python.md").read_text(encoding="utf-8")
FOR_PEOPLE = "7447"


def examples():
    """By their heading."""
    return {re.findall(r"^#+ (.*)$", PAGE[:match.start()], re.M)[-1]: match.group(1)
            for match in re.finditer(r"^```python\n(.*?)^```$", PAGE, re.M | re.S)}


def run(name, port, **names):
    """What the example prints; `names` are there before it, and it adds its own."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(compile(examples()[name].replace(FOR_PEOPLE, str(port)), f"docs/python.md, {name}", "exec"), names)
    return said.getvalue(), names


class DocumentedTest(AtlasCase):

    def flags(self):
        (self.work / "backups").mkdir()
        return "--backup-folder", str(self.work / "backups")

    def test_each_is_run_here(self):
        self.assertEqual(set(examples()), {"Use", "Over TLS", "Watch", "Upload", "Correct", "Look after it"})

    def test_use(self):
        self.drive()
        said, names = run("Use", self.port)
        self.assertRegex(said, r"^11\n\d+ 0 \[\]\n$")
        self.assertTrue(names["blob"])

    def test_watch(self):
        stop = threading.Event()
        changing = threading.Thread(target=self.upload_until, args=(stop,))
        changing.start()
        try:
            said, names = run("Watch", self.port)
        finally:
            stop.set()
            changing.join()
        self.assertRegex(said, r"^\d+ \{\d+: \d+.*\} \[\] \[\] False\n$")
        self.assertTrue(names["store"].tiles)

    def upload_until(self, stop):
        for i in range(1000):
            if stop.wait(0.3):
                return
            self.client.upload_keyframe(self.upload(i, 0.1 * i, radius_cells=8))

    def test_upload(self):
        keyframes = [self.upload(i, i, "monday", radius_cells=8) for i in range(3)]
        self.assertEqual(run("Upload", self.port, keyframes=keyframes)[0], "[0, 1, 2] [] {}\n")
        self.assertEqual(run("Upload", self.port, keyframes=keyframes)[0], "[] [0, 1, 2] {}\n")

    def test_correct(self):
        self.drive()
        before = self.client.digest(60_000).sha256
        self.assertEqual(run("Correct", self.port)[0], "1 1 {}\n1\n")
        self.assertEqual(self.client.digest(60_000).sha256, before)

    def test_look_after_it(self):
        self.drive()
        said, names = run("Look after it", self.port)
        *progress, copied, verified, logged = said.splitlines()
        self.assertTrue(all(re.fullmatch(r"[12] \d+ \d+", line) for line in progress), said)
        self.assertEqual(copied, f"{names['done'].revision} {self.client.digest(60_000).sha256.hex()} ['monday']")
        self.assertRegex(verified, r"^\d+ 0 \[\]$")
        self.assertEqual(logged, "1 backup  monday")


class DocumentedTlsTest(FleetCase):

    def test_over_tls(self):
        before = os.getcwd()
        self.addCleanup(os.chdir, before)
        os.chdir(self.folder)
        said, _ = run("Over TLS", self.daemon.server.rsplit(":", 1)[1])
        self.assertEqual(said, "car.7 vehicle\nalice admin\n")


if __name__ == "__main__":
    unittest.main()
