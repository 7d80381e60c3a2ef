"""Bytes to a daemon and back, in the clear or within TLS, as far as they go without waiting. For one thread."""

import ipaddress
import selectors
import socket
import ssl
import time

from roadatlas.errors import ConnectionLost, PlaintextRefused
from roadatlas.tls import Tls, start_tls, tls_failure

_PROBE_AFTER_S, _PROBE_EVERY_S, _PROBES = 30, 15, 6  # a peer that is gone is noticed after 2 min
_CHUNK_BYTES = 1 << 16


class Transport:
    """Closed by `close`. ConnectionLost, TlsFailed."""

    def __init__(self, host: str, port: int, timeout_s: float, tls: Tls | None, allow_plaintext: bool) -> None:
        """`timeout_s` bounds the connection to each address of the host, and the handshake. PlaintextRefused: without
        TLS, for a host that has an address beyond loopback (127.0.0.0/8, ::1), unless that is allowed."""
        try:
            addresses = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
            if tls is None and not allow_plaintext:
                _refuse_beyond_loopback(addresses)
            self._socket = _connect_to_any(addresses, timeout_s)
        except OSError as error:
            raise ConnectionLost(f"{host}:{port}: {error}") from error
        try:
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            _probe_when_silent(self._socket)
            if tls is not None:
                self._socket = start_tls(self._socket, host, tls)
        except BaseException:
            self._socket.close()
            raise
        self._socket.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._socket, selectors.EVENT_READ)

    def wait(self, wants_to_send: bool, deadline: float) -> tuple[bool, bool]:
        """Whether there may be something to read, and room to send; neither: the deadline passed."""
        if isinstance(self._socket, ssl.SSLSocket) and self._socket.pending():
            return True, False
        self._selector.modify(self._socket, selectors.EVENT_READ | (selectors.EVENT_WRITE if wants_to_send else 0))
        ready = self._selector.select(max(0.0, deadline - time.monotonic()))
        events = ready[0][1] if ready else 0
        return bool(events & selectors.EVENT_READ), bool(events & selectors.EVENT_WRITE)

    def send(self, data: bytearray) -> int:
        """How many bytes went out. BrokenPipeError when the daemon reads no more: it may have said why."""
        try:
            return self._socket.send(data[:_CHUNK_BYTES])
        except (BlockingIOError, ssl.SSLWantReadError, ssl.SSLWantWriteError):
            return 0
        except (BrokenPipeError, ConnectionResetError, ssl.SSLEOFError, ssl.SSLZeroReturnError) as error:
            raise BrokenPipeError from error
        except ssl.SSLError as error:
            raise tls_failure(error) from error
        except OSError as error:
            raise ConnectionLost(str(error)) from error

    def receive(self) -> bytes | None:
        """What came; None: nothing yet; empty: nothing comes any more."""
        try:
            return self._socket.recv(_CHUNK_BYTES)
        except (BlockingIOError, ssl.SSLWantReadError, ssl.SSLWantWriteError):
            return None
        except ssl.SSLError as error:
            raise tls_failure(error) from error
        except OSError as error:
            raise ConnectionLost(str(error)) from error

    def close(self) -> None:
        """Says so within TLS, as far as that goes at once: frames are whole or not without it."""
        self._selector.close()
        if isinstance(self._socket, ssl.SSLSocket):
            try:
                self._socket.unwrap()
            except (OSError, ValueError):
                pass  # it would have to wait for the daemon, or that is gone already
        self._socket.close()


def _refuse_beyond_loopback(addresses: list[tuple]) -> None:
    for *_, (address, *_) in addresses:
        if not ipaddress.ip_address(address).is_loopback:
            raise PlaintextRefused(f"{address} is not this machine, and nothing is sent there in the clear: expected "
                                   "TLS (--tls-ca), or that it is allowed (--allow-plaintext)")


def _connect_to_any(addresses: list[tuple], timeout_s: float) -> socket.socket:
    """To the first that takes us. OSError of the last one."""
    for number, (family, kind, protocol, _, address) in enumerate(addresses, 1):
        connecting = socket.socket(family, kind, protocol)
        try:
            connecting.settimeout(timeout_s)
            connecting.connect(address)
            return connecting
        except BaseException as error:
            connecting.close()
            if number == len(addresses) or not isinstance(error, OSError):
                raise
    raise OSError("no address")


def _probe_when_silent(connected: socket.socket) -> None:
    connected.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for option, value in ((socket.TCP_KEEPIDLE, _PROBE_AFTER_S), (socket.TCP_KEEPINTVL, _PROBE_EVERY_S),
                          (socket.TCP_KEEPCNT, _PROBES)):
        connected.setsockopt(socket.IPPROTO_TCP, option, value)
