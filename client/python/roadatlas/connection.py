"""One TCP connection: frames out, frames in, replies sorted by the request they answer. For one thread.

Sending never waits for the daemon alone: what arrives meanwhile is read, so that pipelined requests
cannot lock both sides. Replies wait here, without a limit of their own, until they are asked for.
"""

import selectors
import socket
import time
from collections import deque

import atlas_pb2
from google.protobuf.message import DecodeError

from roadatlas.errors import BrokenReply, ConnectionLost, DeadlinePassed, RequestRefused, RoadAtlasError
from roadatlas.framing import HEADER, MAX_HELLO_BYTES, MAX_PAYLOAD_BYTES, FrameReader, encode_frame

MAX_IN_FLIGHT = 64  # requests that the daemon reads before the first of them is answered
_READ_BYTES = 1 << 16
_MORE_FOLLOW = ("tile", "sync_manifest")  # bodies that do not end a reply


class Connection:
    """Closed by `close`, or by leaving a `with` block."""

    def __init__(self, host: str, port: int, timeout_s: float) -> None:
        try:
            self._socket = socket.create_connection((host, port), timeout=timeout_s)
        except OSError as error:
            raise ConnectionLost(f"{host}:{port}: {error}") from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._socket, selectors.EVENT_READ)
        self._reader = FrameReader()
        self._to_send = bytearray()
        self._arrived: dict[int, deque[atlas_pb2.Envelope]] = {}
        self._unanswered: set[int] = set()
        self._given_up: set[int] = set()
        self._last_id = 0
        self._end: RoadAtlasError | None = None  # why nothing more arrives
        self.bytes_received = 0  # of whole frames, headers included

    def send(self, field: str, message: object, deadline: float) -> int:
        """The id under which `receive` gives the replies. Waits while MAX_IN_FLIGHT are unanswered."""
        while len(self._unanswered) >= MAX_IN_FLIGHT:
            self._exchange(deadline)
        self._last_id += 1
        payload = atlas_pb2.Envelope(request_id=self._last_id, **{field: message}).SerializeToString()
        self._to_send += encode_frame(payload, MAX_HELLO_BYTES if field == "hello" else MAX_PAYLOAD_BYTES)
        self._unanswered.add(self._last_id)
        self._arrived[self._last_id] = deque()
        try:
            while self._to_send and self._end is None:
                self._exchange(deadline)
        except DeadlinePassed:
            self._give_up(self._last_id)
            raise
        return self._last_id

    def receive(self, request_id: int, deadline: float) -> atlas_pb2.Envelope:
        """The next frame under that id. RequestRefused for an Error; after DeadlinePassed there are no more."""
        arrived = self._arrived[request_id]
        try:
            while not arrived:
                self._exchange(deadline)
        except DeadlinePassed:
            self._give_up(request_id)
            raise
        envelope = arrived.popleft()
        if is_last(envelope):
            del self._arrived[request_id]
        if envelope.WhichOneof("body") == "error":
            raise refusal(envelope)
        return envelope

    def close(self) -> None:
        self._selector.close()
        self._socket.close()

    def _give_up(self, request_id: int) -> None:
        """What still comes for it is dropped."""
        self._given_up.add(request_id)
        del self._arrived[request_id]

    def _exchange(self, deadline: float) -> None:
        """Sends what can be sent and takes what has come; waits for either."""
        if self._end is not None:
            raise self._end
        events = selectors.EVENT_READ | (selectors.EVENT_WRITE if self._to_send else 0)
        self._selector.modify(self._socket, events)
        ready = self._selector.select(max(0.0, deadline - time.monotonic()))
        if not ready:
            raise DeadlinePassed("no answer in time")
        try:
            if ready[0][1] & selectors.EVENT_WRITE:
                self._put()
            if ready[0][1] & selectors.EVENT_READ:
                self._take(self._socket.recv(_READ_BYTES))
        except BlockingIOError:
            pass
        except OSError as error:
            self._end = ConnectionLost(str(error))
        except BrokenReply as error:
            self._end = error

    def _put(self) -> None:
        """A daemon that reads no more may have said why: what it sent is still read."""
        try:
            del self._to_send[:self._socket.send(self._to_send[:_READ_BYTES])]
        except (BrokenPipeError, ConnectionResetError):
            self._to_send.clear()

    def _take(self, data: bytes) -> None:
        if not data:
            self._reader.finish()
            self._end = ConnectionLost("the daemon closed the connection")
        for payload in self._reader.feed(data):
            self.bytes_received += HEADER.size + len(payload)
            try:
                self._sort(atlas_pb2.Envelope.FromString(payload))
            except DecodeError as error:
                raise BrokenReply(f"not an Envelope: {error}") from error

    def _sort(self, envelope: atlas_pb2.Envelope) -> None:
        request_id = envelope.request_id
        if request_id == 0 and envelope.WhichOneof("body") == "error":
            self._end = refusal(envelope)
            return
        if request_id not in self._unanswered:
            raise BrokenReply(f"a reply to request {request_id}, which waits for none")
        if is_last(envelope):
            self._unanswered.remove(request_id)
        if request_id not in self._given_up:
            self._arrived[request_id].append(envelope)
        elif is_last(envelope):
            self._given_up.remove(request_id)


def is_last(envelope: atlas_pb2.Envelope) -> bool:
    return envelope.WhichOneof("body") not in _MORE_FOLLOW


def refusal(envelope: atlas_pb2.Envelope) -> RequestRefused:
    error = envelope.error
    return RequestRefused(envelope.request_id, error.code, error.message, error.retry, error.retry_after_ms)
