"""TLS 1.3 towards a daemon: whom we trust, whom we expect, what we show (docs/daemon.md, Who may come in)."""

import dataclasses
import os
import pathlib
import socket
import ssl

from roadatlas.errors import BadCredentials, CertificateRefused, ConnectionLost, TlsFailed, UntrustedDaemon

_ABOUT_OUR_CERTIFICATE = ("CERTIFICATE", "UNKNOWN_CA", "ACCESS_DENIED")  # parts of the names of alerts
_NOT_TLS = ("WRONG_VERSION_NUMBER", "PACKET_LENGTH_TOO_LONG", "RECORD_LAYER_FAILURE")

Path = str | os.PathLike[str]


@dataclasses.dataclass(frozen=True)
class Tls:
    """Files in PEM. `ca`: who vouches for the daemon. `certificate` and `key`: ours, or neither. `daemon_name`: the
    name that the daemon's certificate must have, if it is not the host that is connected to."""

    ca: Path
    certificate: Path | None = None
    key: Path | None = None
    daemon_name: str = ""

    def context(self) -> ssl.SSLContext:
        """BadCredentials for a file that is of no use."""
        if (self.certificate is None) != (self.key is None):
            raise BadCredentials("a certificate and its key: one without the other is of no use")
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)  # asks for a certificate and compares the name
        context.minimum_version = ssl.TLSVersion.TLSv1_3
        try:
            context.load_verify_locations(cadata=_text_of(self.ca))
        except ssl.SSLError as error:
            raise BadCredentials(f"{self.ca}: no certificates in PEM: {_reason(error)}") from error
        if self.certificate is not None:
            self._load_ours(context)
        return context

    def _load_ours(self, context: ssl.SSLContext) -> None:
        _text_of(self.certificate)
        _text_of(self.key)
        try:
            context.load_cert_chain(self.certificate, self.key, password=_no_password)
        except ssl.SSLError as error:
            raise BadCredentials(f"{self.certificate}, {self.key}: no certificate in PEM with its key: "
                                 f"{_reason(error)}") from error


def start_tls(plain: socket.socket, host: str, tls: Tls) -> ssl.SSLSocket:
    """The handshake, within the socket's timeout. UntrustedDaemon, TlsFailed, ConnectionLost."""
    name = tls.daemon_name or host
    try:
        return tls.context().wrap_socket(plain, server_hostname=name)
    except ssl.SSLCertVerificationError as error:
        raise UntrustedDaemon(f"the daemon's certificate does not count: {error.verify_message}; expected one for "
                              f"{name} that {tls.ca} vouches for") from error
    except ssl.SSLEOFError as error:
        raise TlsFailed(f"{host} ends the handshake: does it speak TLS 1.3?") from error
    except ssl.SSLError as error:
        raise tls_failure(error) from error
    except ConnectionResetError as error:
        raise TlsFailed(f"{host} ends the handshake: does it speak TLS 1.3?") from error
    except OSError as error:
        raise ConnectionLost(f"TLS with {host}: {error}") from error


def tls_failure(error: ssl.SSLError) -> TlsFailed:
    """What broke, and what may be done. The daemon looks at our certificate after our side of the handshake is done:
    that it does not take it shows with the first thing that is read."""
    reason = _reason(error)
    if "ALERT" in reason and any(part in reason for part in _ABOUT_OUR_CERTIFICATE):
        return CertificateRefused(f"the daemon does not take our certificate ({reason}): has it expired, is it from "
                                  "whom the daemon trusts?")
    if reason in _NOT_TLS:
        return TlsFailed(f"the daemon does not speak TLS ({reason}): connect without, or give it a certificate")
    return TlsFailed(f"TLS: {reason}")


def _reason(error: ssl.SSLError) -> str:
    return error.reason or str(error)


def _no_password() -> str:
    raise BadCredentials("the key is encrypted: expected one without a password")


def _text_of(file: Path) -> str:
    try:
        return pathlib.Path(file).read_text(encoding="ascii", errors="replace")
    except OSError as error:
        raise BadCredentials(f"{file}: {error.strerror}") from error
