#!/usr/bin/python3
"""TLS between the client and a daemon: whom each takes for whom, and what is said of what is wrong."""

import os
import socket
import ssl
import subprocess
import sys
import threading
import time
import unittest

from fleet import NAME, FleetCase
from roadatlas import AtlasClient, Code, RequestRefused, Tls
from roadatlas.errors import (BadCredentials, CertificateRefused, ConnectionLost, PlaintextRefused, TlsFailed,
                              UntrustedDaemon)
from support import AtlasCase


class DaemonTest(FleetCase):
    """What the client makes of the daemon."""

    def test_requests_go_through(self):
        client = self.connect(self.tls("car.7"))
        self.assertEqual((client.name, client.role), ("car.7", "vehicle"))
        self.assertEqual(client.status().keyframes, 0)

    def test_another_authority(self):
        with self.assertRaisesRegex(UntrustedDaemon, "expected one for atlas.example that .*alone.pem vouches for"):
            self.connect(self.tls("car.7", ca=self.folder / "alone.pem"))

    def test_another_name(self):
        for name in ("other.example", ""):  # empty: the host, which is 127.0.0.1
            with self.assertRaisesRegex(UntrustedDaemon, "mismatch"):
                self.connect(self.tls("car.7", daemon_name=name))

    def test_expired(self):
        daemon = self.start("--tls-certificate", self.folder / "late.pem", "--tls-key", self.folder / "late.key")
        with self.assertRaisesRegex(UntrustedDaemon, "expired"):
            self.connect(self.tls(), daemon)

    def test_older_versions_are_not_spoken(self):
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.maximum_version = ssl.TLSVersion.TLSv1_2
        context.load_cert_chain(self.folder / "daemon.pem", self.folder / "daemon.key")
        with socket.create_server(("127.0.0.1", 0)) as listener:
            server = threading.Thread(target=self.refuse_one, args=(listener, context))
            server.start()
            with self.assertRaisesRegex(TlsFailed, "(?i)version|TLS 1.3"):
                AtlasClient(*listener.getsockname()[:2], tls=self.tls())
            server.join()

    @staticmethod
    def refuse_one(listener, context):
        peer = listener.accept()[0]
        peer.settimeout(30)
        try:
            context.wrap_socket(peer, server_side=True).close()
        except ssl.SSLError:
            peer.close()

    def test_tls_where_there_is_none_and_none_where_there_is(self):
        with self.assertRaisesRegex(TlsFailed, "does not speak TLS"):
            self.connect(self.tls(), self.start())
        with self.assertRaisesRegex(ConnectionLost, "does it expect TLS"):
            self.connect(None)

    def test_silent_peer_does_not_hold_the_handshake(self):
        with socket.create_server(("127.0.0.1", 0)) as listener:
            began = time.monotonic()
            with self.assertRaises(ConnectionLost):
                AtlasClient(*listener.getsockname()[:2], tls=self.tls(), connect_timeout_s=0.3)
            self.assertLess(time.monotonic() - began, 10)


class CredentialsTest(FleetCase):
    """What the daemon makes of what the client shows."""

    def refused(self, says, tls, **options):
        with self.assertRaisesRegex(RequestRefused, says) as caught:
            self.connect(tls, **options)
        self.assertEqual((caught.exception.code, caught.exception.retry), (Code.PERMISSION_DENIED, False))

    def test_names_and_roles(self):
        for who, role in (("car.7", "vehicle"), ("aligner", "merge"), ("reader", "reader")):
            client = self.connect(self.tls(who))
            self.assertEqual((client.name, client.role), (who, role))
        by_token = self.connect(self.tls(), token=self.token())
        self.assertEqual((by_token.name, by_token.role), ("alice", "admin"))
        both = self.connect(self.tls("car.7"), token=self.token())
        self.assertEqual((both.name, both.role), ("alice", "admin"))

    def test_nothing_to_show(self):
        self.refused("certificate or a token", self.tls())

    def test_tokens_of_no_use(self):
        self.refused("does not know", self.tls(), token=self.token()[::-1])
        expired = self.add_token("bob", "admin", "2020-01-31")
        valid = self.add_token("carol", "reader", "never")
        self.daemon.stop()
        self.setUp()
        self.refused("bob has expired", self.tls("car.7"), token=expired)
        self.assertEqual(self.connect(self.tls(), token=valid).role, "reader")

    def test_certificate_from_somebody_else(self):
        with self.assertRaisesRegex(CertificateRefused, "from whom the daemon trusts"):
            self.connect(self.tls("alone"))

    def test_expired_certificate(self):
        with self.assertRaisesRegex(CertificateRefused, "(?i)expired"):
            self.connect(self.tls("late"))

    def test_files_of_no_use(self):
        (self.folder / "text.pem").write_text("no certificate", encoding="ascii")
        for says, tls in (("none.pem: No such file", self.tls(ca=self.folder / "none.pem")),
                          ("text.pem: no certificates", self.tls(ca=self.folder / "text.pem")),
                          ("none.key: No such file", self.tls("car.7", key=self.folder / "none.key")),
                          ("no certificate in PEM with its key", self.tls("car.7", key=self.folder / "ca.key")),
                          ("without a password", self.tls("car.7", key=self.folder / "locked.key")),
                          ("without the other", self.tls("car.7", key=None))):
            with self.assertRaisesRegex(BadCredentials, says):
                self.connect(tls)


class PlaintextTest(AtlasCase):
    """0.0.0.0 and :: are no loopback addresses, and the system takes them for this machine."""

    def test_nothing_goes_beyond_loopback(self):
        for host in ("0.0.0.0", "::", "224.0.0.1", "255.255.255.255"):
            with self.assertRaisesRegex(PlaintextRefused, f"^{host} is not this machine.*--tls-ca.*--allow-plaintext"):
                AtlasClient(host, self.port, token="secret")

    def test_unless_it_is_allowed_or_within_tls(self):
        with AtlasClient("0.0.0.0", self.port, allow_plaintext=True) as client:
            self.assertEqual(client.status().keyframes, 0)
        with self.assertRaisesRegex(BadCredentials, "none.pem"):
            AtlasClient("0.0.0.0", self.port, tls=Tls(self.work / "none.pem"))

    def test_loopback_is_reached(self):
        for host in ("127.0.0.1", "localhost"):
            with AtlasClient(host, self.port) as client:
                self.assertEqual(client.status().keyframes, 0)

    def test_command(self):
        server = ("status", "--server", f"0.0.0.0:{self.port}")
        for arguments, environment, code in (((), {}, 2), (("--allow-plaintext",), {}, 0),
                                             ((), {"ATLAS_ALLOW_PLAINTEXT": "true"}, 0),
                                             ((), {"ATLAS_ALLOW_PLAINTEXT": "false"}, 2),
                                             ((), {"ATLAS_ALLOW_PLAINTEXT": "perhaps"}, 2)):
            for words in ((*server, *arguments), (*arguments, *server)):
                done = subprocess.run([sys.executable, "-B", "-m", "roadatlas", *words], capture_output=True, text=True,
                                      env={**os.environ, **environment}, check=False, timeout=60)
                self.assertEqual(done.returncode, code, done.stderr)
                self.assertRegex(done.stderr, r"\Aroadatlas: .*\n\Z" if code else r"\A\Z")


class CommandTest(FleetCase):
    """Flags and environment are those of `atlas`."""

    def run_command(self, *arguments, **environment):
        words = [str(self.folder / word) if word.endswith((".pem", ".key", ".token")) else word for word in arguments]
        return subprocess.run([sys.executable, "-B", "-m", "roadatlas", *words], env={**os.environ, **environment},
                              capture_output=True, text=True, check=False, timeout=60)

    def test_flags_and_environment(self):
        server = ("--server", self.daemon.server)
        expected = ("--tls-ca", "ca.pem", "--tls-name", NAME)
        shown = ("--tls-certificate", "car.7.pem", "--tls-key", "car.7.key")
        variables = {"ATLAS_SERVER": self.daemon.server, "ATLAS_TLS_CA": str(self.folder / "ca.pem"),
                     "ATLAS_TLS_NAME": NAME, "ATLAS_TOKEN_FILE": str(self.folder / "alice.token")}
        for arguments, environment, says in (
                ((*server, *expected, *shown, "status"), {}, "taken for car.7, role vehicle\n"),
                (("status", *server, *expected, *shown), {}, "taken for car.7, role vehicle\n"),
                (("status", *server, *expected, "--token-file", "alice.token"), {}, "taken for alice, role admin\n"),
                (("status",), variables, "taken for alice, role admin\n"),
                (("--tls-name", NAME, "status"), {**variables, "ATLAS_TLS_NAME": "x"}, "taken for alice")):
            done = self.run_command(*arguments, **environment)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertIn(says, done.stdout)

    def test_failures_say_what_to_do(self):
        server = ("status", "--server", self.daemon.server)
        for arguments, code, says in (
                (("--tls-certificate", "car.7.pem"), 2, "expected --tls-ca"),
                (("--tls-name", NAME), 2, "expected --tls-ca"),
                (("--tls-ca", "ca.pem", "--tls-key", "car.7.key"), 2, "without the other"),
                (("--tls-ca", "none.pem"), 2, "none.pem"),
                (("--tls-ca", "ca.pem", "--token-file", "none.token"), 2, "there is no token in"),
                (("--tls-ca", "ca.pem"), 1, "expected one for 127.0.0.1"),
                (("--tls-ca", "ca.pem", "--tls-name", NAME), 1, "permission_denied: ")):
            done = self.run_command(*server, *arguments)
            self.assertEqual((done.returncode, done.stdout), (code, ""), done.stderr)
            self.assertRegex(done.stderr, "^roadatlas: ")
            self.assertIn(says, done.stderr)


if __name__ == "__main__":
    unittest.main()
