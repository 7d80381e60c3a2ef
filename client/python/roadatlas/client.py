"""Requests to a daemon and their replies (docs/protocol.md). Not for several threads at a time.

Every method waits for its reply. To have several requests on their way, `submit` them and fetch each
one's reply with `result`. All of them raise RequestRefused for an `Error`, DeadlinePassed, ConnectionLost,
BrokenReply and TlsFailed.
"""

import dataclasses
import time
from collections.abc import Iterable

import atlas_pb2
from google.protobuf.message import Message

from roadatlas.connection import Connection
from roadatlas.errors import BrokenReply
from roadatlas.tls import Tls
from roadatlas.watch import Watch

PROTOCOL_MAJOR = 1
PROTOCOL_MINOR = 9
_FIELD_OF = {field.message_type.full_name: field.name
             for field in atlas_pb2.Envelope.DESCRIPTOR.oneofs_by_name["body"].fields}
_REPLY_TO = {"hello": "hello_reply", "upload_keyframe": "upload_reply", "update_poses": "update_poses_reply",
             "change_session": "change_session_reply", "status_request": "status_reply",
             "sessions_request": "sessions_reply", "wait_request": "wait_reply", "digest_request": "digest_reply",
             "compact_request": "compact_reply", "verify_request": "verify_reply",
             "cancel_request": "cancel_reply"}  # those of one message


@dataclasses.dataclass
class QueryReply:
    """The tiles of a region in the order in which they came, coarse first, and what ended them."""

    tiles: list[atlas_pb2.TileMessage]
    end: atlas_pb2.QueryEnd


@dataclasses.dataclass
class SyncReply:
    """What a sync told. `current_tiles` and `current_blocks`: one for each that was told as held, in order."""

    manifests: list[atlas_pb2.SyncManifest]
    tiles: list[atlas_pb2.TileMessage]
    current_tiles: list[bool]
    current_blocks: list[bool]
    end: atlas_pb2.SyncEnd

    @property
    def removed(self) -> list[int]:
        return list(self.manifests[0].removed)

    @property
    def differing_blocks(self) -> list[int]:
        return list(self.manifests[0].differing_blocks)

    @property
    def not_modified(self) -> int:
        return self.manifests[0].not_modified


class AtlasClient:
    """A connection after its handshake. `hello` is what the daemon said of itself."""

    def __init__(self, host: str = "127.0.0.1", port: int = 7447, *, client_name: str = "python",
                 profile: bytes = b"", tls: Tls | None = None, token: str = "",
                 resume: tuple[str, str] | None = None, connect_timeout_s: float = 5.0, timeout_s: float = 30.0,
                 protocol_major: int = PROTOCOL_MAJOR) -> None:
        """`timeout_s` bounds each request, on top of the time that the request itself allows the daemon. `resume`: the
        vehicle and session that are going to be uploaded, or gone on with."""
        self._timeout_s = timeout_s
        self._awaited: dict[int, str] = {}  # what answers each request that was submitted
        self._connection = Connection(host, port, connect_timeout_s, tls)
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
        """Sends a request that is answered by one message, without waiting for it; the id for `result`."""
        awaited = _REPLY_TO[_field_of(request)]
        request_id = self._send(request)
        self._awaited[request_id] = awaited
        return request_id

    def result(self, request_id: int, timeout_ms: int = 0) -> Message:
        """The reply to a submitted request, once. `timeout_ms` is what the request allowed the daemon."""
        awaited = self._awaited.pop(request_id)
        envelope = self._connection.receive(request_id, self._deadline(timeout_ms))
        if envelope.WhichOneof("body") != awaited:
            raise BrokenReply(f"{envelope.WhichOneof('body')} in place of a {awaited}")
        return getattr(envelope, awaited)

    def upload_keyframe(self, upload: atlas_pb2.UploadKeyframe) -> atlas_pb2.UploadReply:
        return self._call(upload)

    def upload_keyframes(self, uploads: Iterable[atlas_pb2.UploadKeyframe]) -> list[atlas_pb2.UploadReply]:
        """Many at a time on their way; their replies in order."""
        return [self.result(request_id) for request_id in [self.submit(upload) for upload in uploads]]

    def update_poses(self, updates: Iterable[atlas_pb2.PoseUpdate], author: str = "") -> atlas_pb2.UpdatePosesReply:
        """All or nothing."""
        return self._call(atlas_pb2.UpdatePoses(updates=updates, author=author))

    def change_session(self, vehicle: str, session: str, action: int, author: str = "",
                       reason: str = "") -> atlas_pb2.ChangeSessionReply:
        """`action` is ChangeSession.RETRACT, .RESTORE, .RELEASE or .PURGE."""
        return self._call(atlas_pb2.ChangeSession(vehicle=vehicle, session=session, action=action, author=author,
                                                  reason=reason))

    def status(self) -> atlas_pb2.StatusReply:
        return self._call(atlas_pb2.StatusRequest())

    def sessions(self) -> list[atlas_pb2.SessionInfo]:
        """All, by vehicle and session, however many pages they take."""
        sessions: list[atlas_pb2.SessionInfo] = []
        request = atlas_pb2.SessionsRequest()
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

    def wait(self, timeout_ms: int) -> atlas_pb2.WaitReply:
        """Until no tile is dirty; `timed_out` tells."""
        return self._call(atlas_pb2.WaitRequest(timeout_ms=timeout_ms), timeout_ms)

    def digest(self, timeout_ms: int, at_revision: int | None = None) -> atlas_pb2.DigestReply:
        return self._call(atlas_pb2.DigestRequest(timeout_ms=timeout_ms, at_revision=at_revision), timeout_ms)

    def query_region(self, query: atlas_pb2.QueryRegion) -> QueryReply:
        deadline = self._deadline(query.timeout_ms)
        request_id = self._send(query)
        tiles = []
        while True:
            envelope = self._connection.receive(request_id, deadline)
            match envelope.WhichOneof("body"):
                case "tile":
                    tiles.append(envelope.tile)
                case "query_end":
                    return QueryReply(tiles, envelope.query_end)
                case other:
                    raise BrokenReply(f"{other} within the reply to a query")

    def sync(self, request: atlas_pb2.SyncRequest) -> SyncReply:
        """One reply; where `end.cursor` is not empty, the same request with it goes on."""
        deadline = self._deadline(request.timeout_ms)
        request_id = self._send(request)
        manifests: list[atlas_pb2.SyncManifest] = []
        tiles: list[atlas_pb2.TileMessage] = []
        announced = 0
        while True:
            envelope = self._connection.receive(request_id, deadline)
            match envelope.WhichOneof("body"):
                case "sync_manifest" if len(tiles) == announced:
                    manifests.append(envelope.sync_manifest)
                    announced += len(envelope.sync_manifest.keys)
                case "tile" if len(tiles) < announced:
                    _check_announced(envelope.tile, manifests[-1], len(tiles) - announced)
                    if envelope.tile.base_hash and not request.takes_deltas:
                        raise BrokenReply(f"tile {envelope.tile.key:#018x} came as a delta, which was not asked for")
                    tiles.append(envelope.tile)
                case "sync_end" if manifests and len(tiles) == announced:
                    return _sync_reply(request, manifests, tiles, envelope.sync_end)
                case other:
                    raise BrokenReply(f"{other} after {len(tiles)} of {announced} tiles that a sync announced")

    def watch(self, area: atlas_pb2.Area, *, finest_level: int = 0, coarsest_level: int = 0,
              interval_ms: int = 1000) -> Watch:
        """Tells what changes in an area, at most once in an interval, until it is cancelled."""
        deadline = self._deadline(0)
        request_id = self._send(atlas_pb2.WatchRequest(area=area, finest_level=finest_level,
                                                       coarsest_level=coarsest_level, interval_ms=interval_ms))
        return Watch(self._connection, request_id, self._cancel, deadline)

    def _cancel(self, request_id: int) -> bool:
        """False: there was no watch under that id any more."""
        return self._call(atlas_pb2.CancelRequest(request_id=request_id)).cancelled

    def _call(self, request: Message, timeout_ms: int = 0) -> Message:
        return self.result(self.submit(request), timeout_ms)

    def _send(self, request: Message) -> int:
        return self._connection.send(_field_of(request), request, self._deadline(0))

    def _deadline(self, timeout_ms: int) -> float:
        return time.monotonic() + self._timeout_s + timeout_ms / 1000


def _session(resume: tuple[str, str] | None) -> atlas_pb2.Hello.Session | None:
    return atlas_pb2.Hello.Session(vehicle=resume[0], session=resume[1]) if resume else None


def _field_of(request: Message) -> str:
    return _FIELD_OF[request.DESCRIPTOR.full_name]


def _check_announced(tile: atlas_pb2.TileMessage, manifest: atlas_pb2.SyncManifest, index: int) -> None:
    promised = (manifest.keys[index], manifest.revisions[index], manifest.payload_hashes[index],
                manifest.bytes[index])
    if promised != (tile.key, tile.revision, tile.payload_hash, len(tile.blob)):
        raise BrokenReply(f"tile {tile.key:#018x} is not what its manifest announced")


def _sync_reply(request: atlas_pb2.SyncRequest, manifests: list[atlas_pb2.SyncManifest],
                tiles: list[atlas_pb2.TileMessage], end: atlas_pb2.SyncEnd) -> SyncReply:
    held_tiles = sum(len(held.keys) for held in request.held)
    held_blocks = sum(len(held.blocks) for held in request.held)
    return SyncReply(manifests, tiles, _bits(manifests[0].current_tiles, held_tiles),
                     _bits(manifests[0].current_blocks, held_blocks), end)


def _bits(data: bytes, count: int) -> list[bool]:
    """Lowest bit of the first byte first; what is not there is false."""
    value = int.from_bytes(data, "little")
    return [bool(value >> i & 1) for i in range(count)]
