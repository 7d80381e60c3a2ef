"""An authority of one's own, as docs/daemon.md makes it, and daemons that ask for what it issued."""

import hashlib
import pathlib
import re
import subprocess
import tempfile
import unittest

import atlas_pb2
from roadatlas import AtlasClient, Tls
from roadatlas.profile import parse_profile
from support import BIN_DIR, ROOT, SMALL, START_MS, Daemon, pose_at, road_blob

NAME = "atlas.example"
_OTHERS = """
issue reader /OU=reader/CN=reader
openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -subj /CN=alone -keyout alone.key -out alone.pem
openssl req -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -subj /CN=late -keyout late.key -out late.csr
openssl x509 -req -in late.csr -CA ca.pem -CAkey ca.key -CAcreateserial -days -1 -out late.pem \
  -extfile <(echo subjectAltName=DNS:atlas.example)
openssl ec -in car.7.key -aes128 -passout pass:secret -out locked.key
"""


def documented_commands():
    """Of "Who may come in", without the lines that start programs of ours."""
    page = (ROOT / "docs/daemon.md").read_text(encoding="utf-8")
    section = re.search(r"## Who may come in\n(.*?)\n## ", page, re.S).group(1)
    lines = [line[4:] for line in section.splitlines() if line.startswith("    ")]
    return "\n".join(line for line in lines if not line.startswith(("atlasd ", "atlas ")))


class FleetCase(unittest.TestCase):
    """The files of a fleet are made once for all tests of a class; the daemon, with TLS, is each test's own."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        subprocess.run(["bash", "-e"], input=documented_commands() + _OTHERS, cwd=cls.folder, text=True, timeout=60,
                       check=True, capture_output=True)

    def setUp(self):
        self.daemon = self.start("--tls-certificate", self.folder / "daemon.pem", "--tls-key",
                                 self.folder / "daemon.key", "--tls-client-ca", self.folder / "ca.pem", "--tokens",
                                 self.folder / "tokens")

    def start(self, *flags):
        data = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory())) / "atlas"
        return self.enterContext(Daemon(BIN_DIR, data, *SMALL, *map(str, flags)))

    def tls(self, who=None, **others):
        ours = {"certificate": self.folder / f"{who}.pem", "key": self.folder / f"{who}.key"} if who else {}
        return Tls(**{"ca": self.folder / "ca.pem", "daemon_name": NAME, **ours, **others})

    def connect(self, tls, daemon=None, **options):
        host, port = (daemon or self.daemon).server.rsplit(":", 1)
        return self.enterContext(AtlasClient(host, int(port), tls=tls, **options))

    def token(self, owner="alice"):
        return (self.folder / f"{owner}.token").read_text(encoding="ascii").strip()

    def add_token(self, owner, role, expires):
        """It counts for daemons that start afterwards."""
        token = hashlib.sha256(owner.encode()).hexdigest()
        with (self.folder / "tokens").open("a", encoding="ascii") as file:
            file.write(f"{owner} {role} {expires} {hashlib.sha256(token.encode()).hexdigest()}\n")
        (self.folder / f"{owner}.token").write_text(token + "\n", encoding="ascii")
        return token


def keyframe_of(vehicle, client, sequence=0):
    profile = parse_profile(client.hello.profile)
    return atlas_pb2.UploadKeyframe(
        key=atlas_pb2.KeyframeKey(vehicle=vehicle, session="s", sequence=sequence), time_ms=START_MS,
        pose=pose_at(sequence), blob=road_blob(8, 0, profile.hash, profile.cell_size_um))
