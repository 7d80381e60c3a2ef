"""One TCP connection: frames out, frames in, replies sorted by the request they answer. For one thread.

Sending never waits for the daemon alone: what arrives meanwhile is read, so that pipelined requests
cannot lock both sides. Replies wait here, without a limit of their own, until they are asked for; events of
a watch that are not fetched become one.
"""

from collections import deque

import atlas_pb2
from google.protobuf.message import DecodeError

from roadatlas.changes import merge_events
from roadatlas.errors import BrokenReply, ConnectionLost, DeadlinePassed, RequestRefused, RoadAtlasError, TlsFailed
from roadatlas.framing import HEADER, MAX_HELLO_BYTES, MAX_PAYLOAD_BYTES, FrameReader, encode_frame
from roadatlas.tls import Tls
from roadatlas.transport import Transport

MAX_IN_FLIGHT = 64  # requests that the daemon reads before the first of them is answered
MAX_WAITING_EVENTS = 16  # of one watch; what comes beyond them is told in the last one
_MORE_FOLLOW = ("tile", "sync_manifest", "watch_event", "keyframe")  # bodies that do not end a reply
_LAST_STAGES = (atlas_pb2.BackupReply.UNKNOWN, atlas_pb2.BackupReply.DONE)  # the first one's is a list


class Connection:
    """Closed by `close`, or by leaving a `with` block."""

    def __init__(self, host: str, port: int, timeout_s: float, tls: Tls | None, allow_plaintext: bool) -> None:
        self._transport = Transport(host, port, timeout_s, tls, allow_plaintext)
        self._was_heard = tls is not None
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
        frame = encode_frame(payload, MAX_HELLO_BYTES if field == "hello" else MAX_PAYLOAD_BYTES)
        self._arrived[self._last_id] = deque()
        self._unanswered.add(self._last_id)
        self._to_send += frame
        try:
            while self._to_send and self._end is None:
                self._exchange(deadline)
        except BaseException:  # an interrupt, too
            self.forget(self._last_id)
            raise
        return self._last_id

    def receive(self, request_id: int, deadline: float) -> atlas_pb2.Envelope:
        """The next frame under that id. RequestRefused for an Error; whoever asks no further forgets it."""
        envelope = self.poll(request_id, deadline)
        if envelope is None:
            raise DeadlinePassed("no answer in time")
        return envelope

    def poll(self, request_id: int, deadline: float) -> atlas_pb2.Envelope | None:
        """As `receive`, but that nothing came until then means no more than that."""
        arrived = self._arrived[request_id]
        try:
            while not arrived:
                self._exchange(deadline)
        except DeadlinePassed:
            return None
        envelope = arrived.popleft()
        if is_last(envelope):
            del self._arrived[request_id]
        if envelope.WhichOneof("body") == "error":
            raise refusal(envelope)
        return envelope

    def forget(self, request_id: int) -> bool:
        """What still comes for it is dropped; false: nothing does."""
        is_on_its_way = request_id in self._unanswered
        if is_on_its_way:
            self._given_up.add(request_id)
        self._arrived.pop(request_id, None)
        return is_on_its_way

    def close(self) -> None:
        """Whoever waits for a reply afterwards is told ConnectionLost."""
        self._end = self._end or ConnectionLost("this client was closed: connect again")
        self._transport.close()

    def _exchange(self, deadline: float) -> None:
        """Sends what can be sent and takes what has come; waits for either."""
        if self._end is not None:
            raise self._end
        may_read, may_send = self._transport.wait(bool(self._to_send), deadline)
        if not may_read and not may_send:
            raise DeadlinePassed("no answer in time")
        try:
            if may_send:
                self._put()
            if may_read:
                self._take(self._transport.receive())
        except (ConnectionLost, TlsFailed, BrokenReply) as error:
            self._end = error
        except BaseException:  # an interrupt: bytes may be lost between the socket and the frames
            self._end = ConnectionLost("interrupted while bytes moved: connect again")
            raise

    def _put(self) -> None:
        """A daemon that reads no more may have said why: what it sent is still read."""
        try:
            del self._to_send[:self._transport.send(self._to_send)]
        except BrokenPipeError:
            self._to_send.clear()

    def _take(self, data: bytes | None) -> None:
        if data is None:
            return
        if not data:
            self._reader.finish()
            self._end = ConnectionLost("the daemon closed the connection" if self._was_heard else
                                       "the daemon closed the connection without a word: does it expect TLS?")
        self._was_heard = True
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
            self._keep(envelope, self._arrived[request_id])
        elif is_last(envelope):
            self._given_up.remove(request_id)

    @staticmethod
    def _keep(envelope: atlas_pb2.Envelope, arrived: deque[atlas_pb2.Envelope]) -> None:
        if len(arrived) >= MAX_WAITING_EVENTS and envelope.WhichOneof("body") == "watch_event":
            merge_events(arrived[-1].watch_event, envelope.watch_event)
        else:
            arrived.append(envelope)


def is_last(envelope: atlas_pb2.Envelope) -> bool:
    body = envelope.WhichOneof("body")
    return body not in _MORE_FOLLOW and (body != "backup_reply" or envelope.backup_reply.stage in _LAST_STAGES)


def refusal(envelope: atlas_pb2.Envelope) -> RequestRefused:
    error = envelope.error
    return RequestRefused(envelope.request_id, error.code, error.message, error.retry, error.retry_after_ms,
                          error.reason)
