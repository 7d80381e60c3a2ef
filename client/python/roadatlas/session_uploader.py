"""Uploads a session, and goes on behind what the daemon has when the connection broke (docs/protocol.md)."""

import dataclasses
import random
import time
from collections import deque
from collections.abc import Callable, Iterable

import atlas_pb2

from roadatlas.client import AtlasClient
from roadatlas.errors import (
    Code, ConnectionLost, DeadlinePassed, FrameCut, OtherAtlas, RequestRefused, RoadAtlasError)

ON_THEIR_WAY = 32  # keyframes sent and not answered
_LONGEST_PAUSE_S = 30.0


@dataclasses.dataclass
class UploadReport:
    """Sequence numbers: acknowledged in this call, there already as the daemon says, refused for good and why."""

    acknowledged: list[int] = dataclasses.field(default_factory=list)
    there_already: list[int] = dataclasses.field(default_factory=list)
    refused: dict[int, RequestRefused] = dataclasses.field(default_factory=dict)


class SessionUploader:
    """Connects for itself, and again after a failure that may pass, to one atlas: the first that answers."""

    def __init__(self, connect: Callable[..., AtlasClient], vehicle: str, session: str, *, rising: bool = False,
                 attempts: int = 8, first_pause_s: float = 0.5) -> None:
        """`connect` makes a client and takes `resume`: functools.partial(AtlasClient, host, port). `rising`: whoever
        uploads this session never goes back in it, so that what is not above the daemon's last sequence number was
        dealt with (stored, or refused for good) and is not sent again; it counts as there already. Gives up when so
        many `attempts` in a row brought nothing forward; the pause between these doubles."""
        self._connect = connect
        self._vehicle = vehicle
        self._session = session
        self._rising = rising
        self._attempts = attempts
        self._first_pause_s = first_pause_s
        self._atlas_id: bytes | None = None

    def upload(self, uploads: Iterable[atlas_pb2.UploadKeyframe]) -> UploadReport:
        """All of them, by sequence number. Raises why it gave up, RequestRefused at once for a client that may not
        upload at all: nothing is wrong with its keyframes, and whoever has them keeps them; OtherAtlas at once: what
        was acknowledged is not in that one. What is on disk is not sent by the next call."""
        work = _Work(uploads, self._vehicle, self._session, self._rising)
        failures = 0
        while work.waiting:
            before = len(work.waiting)
            failure = self._attempt(work)
            if not work.waiting:
                break
            failures = 0 if len(work.waiting) < before else failures + 1
            if failures >= self._attempts:
                raise failure
            time.sleep(self._pause_s(failures, failure))
        return work.report

    def _attempt(self, work: "_Work") -> RoadAtlasError | None:
        """Why something is left, if it may pass."""
        try:
            with self._connect(resume=(self._vehicle, self._session)) as client:
                self._check_atlas(client.atlas_id)
                work.begin(client.epoch)
                work.skip(client.last_sequence)
                work.send(client)
        except RequestRefused as error:
            if not error.retry:
                raise
            return error
        except (ConnectionLost, DeadlinePassed, FrameCut) as error:
            return error
        if work.denied is not None:
            raise work.denied
        return next(iter(work.postponed.values()), None)

    def _check_atlas(self, atlas_id: bytes) -> None:
        if self._atlas_id not in (None, atlas_id):
            raise OtherAtlas(f"atlas {atlas_id.hex()} answers, the session went to {self._atlas_id.hex()}")
        self._atlas_id = atlas_id

    def _pause_s(self, failures: int, failure: RoadAtlasError) -> float:
        asked_s = failure.retry_after_ms / 1000 if isinstance(failure, RequestRefused) else 0.0
        ours_s = random.uniform(0.5, 1) * min(self._first_pause_s * 2**failures, _LONGEST_PAUSE_S)
        return max(asked_s, ours_s)


class _Work:
    """What is left, by rising sequence number: the daemon takes nothing behind what it refused for now (`postponed`), so
    that its last sequence number tells of all before it, if whoever uploads the session always rises. Else it says
    nothing: all are sent, and the daemon says which it has."""

    def __init__(self, uploads: Iterable[atlas_pb2.UploadKeyframe], vehicle: str, session: str, rising: bool) -> None:
        self._rising = rising
        self.waiting: dict[int, atlas_pb2.UploadKeyframe] = {}
        self.postponed: dict[int, RequestRefused] = {}
        self.denied: RequestRefused | None = None  # not the keyframe, but whoever sends it
        self.report = UploadReport()
        for upload in sorted(uploads, key=lambda upload: upload.key.sequence):
            if (upload.key.vehicle, upload.key.session) != (vehicle, session) or upload.key.sequence in self.waiting:
                raise ValueError(f"keyframe {upload.key.vehicle}/{upload.key.session}/{upload.key.sequence} comes "
                                 f"twice or is not of {vehicle}/{session}")
            self.waiting[upload.key.sequence] = upload
        self._all = dict(self.waiting)
        self._epoch: int | None = None

    def begin(self, epoch: int) -> None:
        """On each connection. An atlas that was restored from a backup lacks some of what was acknowledged before: it is
        asked for all again, but for what it refused for good."""
        if self._epoch not in (None, epoch):
            self.waiting = {number: upload for number, upload in self._all.items() if number not in self.report.refused}
            self.report.acknowledged.clear()
            self.report.there_already.clear()
        self._epoch = epoch

    def skip(self, last_sequence: int | None) -> None:
        if last_sequence is None or not self._rising:
            return
        there = [sequence for sequence in self.waiting if sequence <= last_sequence]
        for sequence in there:
            del self.waiting[sequence]
        self.report.there_already += there

    def send(self, client: AtlasClient) -> None:
        on_their_way: deque[tuple[int, int]] = deque()
        try:
            for sequence, upload in list(self.waiting.items()):
                on_their_way.append((sequence, client.submit(upload)))
                if len(on_their_way) >= ON_THEIR_WAY:
                    self._take_reply(client, *on_their_way.popleft())
                if self.denied is not None:
                    break
        finally:  # what was answered before the connection broke counts
            while on_their_way:
                self._take_reply(client, *on_their_way.popleft())

    def _take_reply(self, client: AtlasClient, sequence: int, request_id: int) -> None:
        try:
            reply = client.result(request_id)
        except RequestRefused as refusal:
            if refusal.request_id == 0:
                raise
            if refusal.retry:
                self.postponed[sequence] = refusal
                return
            if refusal.code == Code.PERMISSION_DENIED and not self._is_of_another(client, sequence):
                self.denied = refusal
                return
            self.report.refused[sequence] = refusal
        else:
            (self.report.there_already if reply.duplicate else self.report.acknowledged).append(sequence)
        del self.waiting[sequence]
        self.postponed.pop(sequence, None)

    def _is_of_another(self, client: AtlasClient, sequence: int) -> bool:
        """A vehicle uploads under its own name: the keyframe of another comes under the wrong one whenever it comes."""
        return client.role == "vehicle" and client.name not in ("", self.waiting[sequence].key.vehicle)
