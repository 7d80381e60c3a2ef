"""Requests to a daemon and their replies (docs/protocol.md). Not for several threads at a time.

Every method waits for its reply. To have several requests on their way, `submit` them and fetch each
one's reply with `result`. All of them raise RequestRefused for an `Error`, DeadlinePassed, ConnectionLost,
BrokenReply and TlsFailed.
"""

import contextlib
import dataclasses
import time
from collections.abc import Callable, Iterable, Iterator

import atlas_pb2
from google.protobuf.message import Message

from roadatlas.connection import Connection
from roadatlas.errors import BrokenReply, DaemonTooOld
from roadatlas.sync_reply import SyncReply, read_sync_reply
from roadatlas.tls import Tls
from roadatlas.watch import Watch

PROTOCOL_MAJOR = 1
PROTOCOL_MINOR = 11
_FIELD_OF = {field.message_type.full_name: field.name
             for field in atlas_pb2.Envelope.DESCRIPTOR.oneofs_by_name["body"].fields}
_REPLY_TO = {"hello": "hello_reply", "upload_keyframe": "upload_reply", "update_poses": "update_poses_reply",
             "undo_poses": "update_poses_reply",
             "change_session": "change_session_reply", "keyframes_request": "keyframes_reply",
             "status_request": "status_reply", "sessions_request": "sessions_reply", "wait_request": "wait_reply", "digest_request": "digest_reply",
             "compact_request": "compact_reply", "verify_request": "verify_reply",
             "log_request": "log_reply", "cancel_request": "cancel_reply"}  # those of one message


@dataclasses.dataclass
class QueryReply:
    """The tiles of a region in the order in which they came, coarse first, and what ended them."""

    tiles: list[atlas_pb2.TileMessage]
    end: atlas_pb2.QueryEnd


@dataclasses.dataclass
class KeyframesRead:
    """A session's keyframes with their blobs, by sequence number. `damaged` ones are not among them: how each of these is,
    by its number. Where `end.has_more`, ask again behind the last one of both."""

    keyframes: list[atlas_pb2.KeyframeMessage]
    damaged: dict[int, str]
    end: atlas_pb2.KeyframesEnd


class AtlasClient:
    """A connection after its handshake. `hello` is what the daemon said of itself."""

    def __init__(self, host: str = "127.0.0.1", port: int = 7447, *, client_name: str = "python",
                 profile: bytes = b"", tls: Tls | None = None, allow_plaintext: bool = False, token: str = "",
                 resume: tuple[str, str] | None = None, connect_timeout_s: float = 5.0, timeout_s: float = 30.0,
                 protocol_major: int = PROTOCOL_MAJOR) -> None:
        """`timeout_s` bounds each request, on top of the time that the request itself allows the daemon. `resume`: the
        vehicle and session that are going to be uploaded, or gone on with. Without `tls` only this machine is connected
        to (else PlaintextRefused), unless `allow_plaintext`: whoever is on the way reads the token."""
        self._timeout_s = timeout_s
        self._awaited: dict[int, str] = {}  # what answers each request that was submitted
        self._connection = Connection(host, port, connect_timeout_s, tls, allow_plaintext)
        try:
            self.hello: atlas_pb2.HelloReply = self._call(atlas_pb2.Hello(
                protocol_major=protocol_major, protocol_minor=PROTOCOL_MINOR, client_name=client_name,
                profile=profile, token=token, resume=_session(resume)))
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> "AtlasClient":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self._connection.close()

    @property
    def name(self) -> str:
        """Whom the daemon takes us for; empty: nobody in particular."""
        return self.hello.name

    @property
    def role(self) -> str:
        """What the daemon lets us do: "reader", "vehicle", "merge" or "admin"; empty before version 1.5."""
        return self.hello.role

    @property
    def atlas_id(self) -> bytes:
        """Of this atlas, whatever daemon serves it: 16 bytes."""
        return self.hello.atlas_id

    @property
    def epoch(self) -> int:
        """Another number after the atlas was restored from a backup."""
        return self.hello.epoch

    @property
    def last_sequence(self) -> int | None:
        """Of the session to be resumed, when the connection began; None: nothing of it is there."""
        return self.hello.last_sequence if self.hello.HasField("last_sequence") else None

    @property
    def bytes_received(self) -> int:
        """Of all frames so far, headers included."""
        return self._connection.bytes_received

    def submit(self, request: Message) -> int:
        """Sends a request that is answered by one message, without waiting for it; the id for `result`. DaemonTooOld:
        it would put a staged session into the map, or correct poses without a look at the condition."""
        if isinstance(request, atlas_pb2.UploadKeyframe) and request.staged:
            self._needs_minor(10, "a staged session")
        if isinstance(request, atlas_pb2.UpdatePoses) and (request.if_revision or request.publish):
            self._needs_minor(11, "a batch with a condition, or one that publishes,")
        awaited = _REPLY_TO[_field_of(request)]
        request_id = self._send(request)
        self._awaited[request_id] = awaited
        return request_id

    def result(self, request_id: int, timeout_ms: int = 0) -> Message:
        """The reply to a submitted request, once. `timeout_ms` is what the request allowed the daemon."""
        awaited = self._awaited.pop(request_id)
        try:
            return _body_of(self._connection.receive(request_id, self._deadline(timeout_ms)), awaited)
        finally:
            self._connection.forget(request_id)

    def upload_keyframe(self, upload: atlas_pb2.UploadKeyframe) -> atlas_pb2.UploadReply:
        return self._call(upload)

    def upload_keyframes(self, uploads: Iterable[atlas_pb2.UploadKeyframe]) -> list[atlas_pb2.UploadReply]:
        """Many at a time on their way; their replies in order."""
        return [self.result(request_id) for request_id in [self.submit(upload) for upload in uploads]]

    def update_poses(self, updates: Iterable[atlas_pb2.PoseUpdate], author: str = "", *, if_revision: int = 0,
                     publish: Iterable[tuple[str, str]] = ()) -> atlas_pb2.UpdatePosesReply:
        """All or nothing. `if_revision`: only if nothing changed since about the sessions concerned, else RequestRefused
        with `conflict`. `publish`: vehicle and session of staged ones that come into the map by the same step."""
        names = [atlas_pb2.SessionName(vehicle=vehicle, session=session) for vehicle, session in publish]
        return self._call(atlas_pb2.UpdatePoses(updates=updates, author=author, if_revision=if_revision, publish=names))

    def undo_poses(self, batch: int, author: str = "") -> atlas_pb2.UpdatePosesReply:
        """What the batch changed is as it was before it, by another batch."""
        self._needs_minor(11, "to undo a batch")
        return self._call(atlas_pb2.UndoPoses(batch=batch, author=author))

    def change_session(self, vehicle: str, session: str, action: int, author: str = "",
                       reason: str = "") -> atlas_pb2.ChangeSessionReply:
        """`action` is ChangeSession.RETRACT, .RESTORE, .RELEASE, .PUBLISH or .PURGE."""
        return self._call(atlas_pb2.ChangeSession(vehicle=vehicle, session=session, action=action, author=author,
                                                  reason=reason))

    def status(self) -> atlas_pb2.StatusReply:
        return self._call(atlas_pb2.StatusRequest())

    def sessions(self, *, changed: bool = False) -> list[atlas_pb2.SessionInfo]:
        """All, by vehicle and session, however many pages they take. `damaged` ones say what is in `reason`. `changed`:
        with their `changed_revision`, which takes the daemon longer."""
        if changed:
            self._needs_minor(11, "when sessions changed")
        sessions: list[atlas_pb2.SessionInfo] = []
        request = atlas_pb2.SessionsRequest(changed=changed)
        while True:
            reply = self._call(request)
            for session in reply.sessions:
                if (session.vehicle, session.session) <= (request.after_vehicle, request.after_session):
                    raise BrokenReply(f"session {session.vehicle}/{session.session} comes twice, or out of order")
                sessions.append(session)
                request.after_vehicle, request.after_session = session.vehicle, session.session
            if not reply.has_more:
                return sessions
            if not reply.sessions:
                raise BrokenReply("there are more sessions, and none of them came")

    def keyframes(self, vehicle: str, session: str) -> list[atlas_pb2.KeyframeInfo]:
        """A session's stored ones with their poses of now, by sequence number, however many pages they take."""
        self._needs_minor(10, "a list of keyframes")
        keyframes: list[atlas_pb2.KeyframeInfo] = []
        request = atlas_pb2.KeyframesRequest(vehicle=vehicle, session=session)
        while True:
            reply = self._call(request)
            for keyframe in reply.keyframes:
                if keyframes and keyframe.sequence <= keyframes[-1].sequence:
                    raise BrokenReply(f"keyframe {keyframe.sequence} comes twice, or out of order")
                keyframes.append(keyframe)
                request.after_sequence = keyframe.sequence
            if not reply.has_more:
                return keyframes
            if not reply.keyframes:
                raise BrokenReply("there are more keyframes, and none of them came")

    def read_keyframes(self, vehicle: str, session: str, *, after_sequence: int | None = None,
                       budget_bytes: int = 64 << 20) -> KeyframesRead:
        """One reply: a session's keyframes as they were uploaded, where they are now, behind `after_sequence`. It takes
        no more than the budget, all frames counted (0: as many as there are)."""
        self._needs_minor(11, "to read keyframes")
        read = KeyframesRead([], {}, atlas_pb2.KeyframesEnd())
        last = -1 if after_sequence is None else after_sequence
        request = atlas_pb2.ReadKeyframes(vehicle=vehicle, session=session, after_sequence=after_sequence,
                                          budget_bytes=budget_bytes)
        with self._frames_of_reply(request, 0) as receive:
            while (envelope := receive()).WhichOneof("body") == "keyframe":
                keyframe = envelope.keyframe
                if keyframe.sequence <= last:
                    raise BrokenReply(f"keyframe {keyframe.sequence} comes twice, or out of order")
                last = keyframe.sequence
                if keyframe.damage:
                    read.damaged[last] = keyframe.damage
                else:
                    read.keyframes.append(keyframe)
            read.end = _body_of(envelope, "keyframes_end")
        if read.end.keyframes != len(read.keyframes) + len(read.damaged):
            raise BrokenReply(f"{read.end.keyframes} keyframes were to come, others did")
        return read

    def wait(self, timeout_ms: int) -> atlas_pb2.WaitReply:
        """Until no tile is dirty; `timed_out` tells."""
        return self._call(atlas_pb2.WaitRequest(timeout_ms=timeout_ms), timeout_ms)

    def digest(self, timeout_ms: int, at_revision: int | None = None) -> atlas_pb2.DigestReply:
        return self._call(atlas_pb2.DigestRequest(timeout_ms=timeout_ms, at_revision=at_revision), timeout_ms)

    def verify(self, timeout_ms: int, *, rebuild: bool = False, repair: bool = False,
               author: str = "") -> atlas_pb2.VerifyReply:
        """Reads everything back. `rebuild`: and fuses every tile again; `repair`: and restores what is damaged, as far
        as something tells what it was. DaemonTooOld: it would repair nothing, and not say so."""
        if repair:
            self._needs_minor(8, "a verification that repairs")
        return self._call(atlas_pb2.VerifyRequest(rebuild=rebuild, timeout_ms=timeout_ms, repair=repair,
                                                  author=author), timeout_ms)

    def log(self, after_id: int = 0) -> list[atlas_pb2.LogReply.Event]:
        """What happened beside uploads behind that event, oldest first, however many replies it takes."""
        events: list[atlas_pb2.LogReply.Event] = []
        while page := self._call(atlas_pb2.LogRequest(after_id=after_id)).events:
            for event in page:
                if event.id <= after_id:
                    raise BrokenReply(f"event {event.id} of the log comes twice, or out of order")
                events.append(event)
                after_id = event.id
        return events

    def backup(self, name: str, timeout_ms: int, *, author: str = "",
               on_progress: Callable[[atlas_pb2.BackupReply], None] | None = None) -> atlas_pb2.BackupReply:
        """Has the daemon write a copy of its atlas, and read it back; what it says when that is done. `on_progress`
        hears how far it is. Whoever gives up before, by whatever exception, closes this client: that ends the backup.
        """
        if not name:
            raise ValueError("a backup without a name: expected one, backups() lists those that are there")
        deadline = self._deadline(timeout_ms)
        request_id = self._send(atlas_pb2.BackupRequest(name=name, author=author, timeout_ms=timeout_ms))
        try:
            while True:
                reply = _body_of(self._connection.receive(request_id, deadline), "backup_reply")
                match reply.stage:
                    case atlas_pb2.BackupReply.DONE:
                        return reply
                    case atlas_pb2.BackupReply.UNKNOWN:
                        raise BrokenReply("a backup without a stage")
                if on_progress is not None:
                    on_progress(reply)
        finally:
            if self._connection.forget(request_id):
                self.close()

    def backups(self) -> list[atlas_pb2.BackupReply.Backup]:
        """Those in the daemon's folder."""
        with self._frames_of_reply(atlas_pb2.BackupRequest(), 0) as receive:
            return list(_body_of(receive(), "backup_reply").backups)

    def query_region(self, query: atlas_pb2.QueryRegion) -> QueryReply:
        with self._frames_of_reply(query, query.timeout_ms) as receive:
            tiles = []
            while True:
                envelope = receive()
                match envelope.WhichOneof("body"):
                    case "tile":
                        tiles.append(envelope.tile)
                    case "query_end":
                        return QueryReply(tiles, envelope.query_end)
                    case other:
                        raise BrokenReply(f"{other} within the reply to a query")

    def sync(self, request: atlas_pb2.SyncRequest) -> SyncReply:
        """One reply; where `end.cursor` is not empty, the same request with it goes on."""
        with self._frames_of_reply(request, request.timeout_ms) as receive:
            return read_sync_reply(request, receive)

    def watch(self, area: atlas_pb2.Area, *, finest_level: int = 0, coarsest_level: int = 0,
              interval_ms: int = 1000) -> Watch:
        """Tells what changes in an area, at most once in an interval, until it is cancelled."""
        deadline = self._deadline(0)
        request_id = self._send(atlas_pb2.WatchRequest(area=area, finest_level=finest_level,
                                                       coarsest_level=coarsest_level, interval_ms=interval_ms))
        try:
            return Watch(self._connection, request_id, self._cancel, deadline)
        except BaseException:
            if self._connection.forget(request_id):  # it may begin still
                self._connection.forget(self._send(atlas_pb2.CancelRequest(request_id=request_id)))
            raise

    def _cancel(self, request_id: int) -> bool:
        """False: there was no watch under that id any more."""
        return self._call(atlas_pb2.CancelRequest(request_id=request_id)).cancelled

    @contextlib.contextmanager
    def _frames_of_reply(self, request: Message, timeout_ms: int) -> Iterator[Callable[[], atlas_pb2.Envelope]]:
        """Gives what waits for the next frame. What still comes when the block is left is dropped."""
        deadline = self._deadline(timeout_ms)
        request_id = self._send(request)
        try:
            yield lambda: self._connection.receive(request_id, deadline)
        finally:
            self._connection.forget(request_id)

    def _needs_minor(self, minor: int, what: str) -> None:
        if self.hello.protocol_minor < minor:
            raise DaemonTooOld(f"{what} needs a daemon of version {PROTOCOL_MAJOR}.{minor}, this one speaks "
                               f"{PROTOCOL_MAJOR}.{self.hello.protocol_minor}")

    def _call(self, request: Message, timeout_ms: int = 0) -> Message:
        return self.result(self.submit(request), timeout_ms)

    def _send(self, request: Message) -> int:
        return self._connection.send(_field_of(request), request, self._deadline(0))

    def _deadline(self, timeout_ms: int) -> float:
        return time.monotonic() + self._timeout_s + timeout_ms / 1000


def _session(resume: tuple[str, str] | None) -> atlas_pb2.Hello.Session | None:
    return atlas_pb2.Hello.Session(vehicle=resume[0], session=resume[1]) if resume else None


def _body_of(envelope: atlas_pb2.Envelope, awaited: str) -> Message:
    if envelope.WhichOneof("body") != awaited:
        raise BrokenReply(f"{envelope.WhichOneof('body')} in place of a {awaited}")
    return getattr(envelope, awaited)


def _field_of(request: Message) -> str:
    return _FIELD_OF[request.DESCRIPTOR.full_name]
