"""A watch under way: changes as they come, and its end. Other requests go on beside it, on the same connection.

Events arrive whenever the client reads: in `next`, and while it waits for other replies. Those that nobody
fetches become one (changes.py), so that memory does not grow with them.
"""

import time
from collections.abc import Callable, Iterator

import atlas_pb2

from roadatlas.changes import Changes, changes_of
from roadatlas.connection import Connection
from roadatlas.errors import BrokenReply, RoadAtlasError

_LOOK_AGAIN_S = 60.0

class Watch:
    """Cancelled by `cancel`, or by leaving a `with` block. `since`: from this revision on everything is told."""

    def __init__(self, connection: Connection, request_id: int, cancel: Callable[[int], bool], deadline: float) -> None:
        """Waits for the first event. RequestRefused: an area or levels that make no sense, or too many watches."""
        self._connection = connection
        self._request_id = request_id
        self._cancel = cancel
        self._is_over = False
        self.since = changes_of(self._event(connection.receive(request_id, deadline))).revision

    def __iter__(self) -> Iterator[Changes]:
        """Until it is cancelled. RequestRefused (unavailable) when the daemon stops, ConnectionLost when it is gone."""
        while not self._is_over:
            changes = self.next(_LOOK_AGAIN_S)
            if changes is not None:
                yield changes

    def next(self, timeout_s: float) -> Changes | None:
        """What changed; None if nothing was told in that time, or if the watch was cancelled."""
        if self._is_over:
            return None
        try:
            envelope = self._connection.poll(self._request_id, time.monotonic() + timeout_s)
        except RoadAtlasError:
            self._is_over = True
            raise
        return None if envelope is None else changes_of(self._event(envelope))

    def cancel(self) -> None:
        """Nothing is told any more. What came and was not fetched is dropped."""
        if self._is_over:
            return
        self._is_over = True
        self._connection.forget(self._request_id)
        self._cancel(self._request_id)

    def __enter__(self) -> "Watch":
        return self

    def __exit__(self, failure: type[BaseException] | None, *_: object) -> None:
        try:
            self.cancel()
        except RoadAtlasError:
            if failure is None:
                raise

    @staticmethod
    def _event(envelope: atlas_pb2.Envelope) -> atlas_pb2.WatchEvent:
        if envelope.WhichOneof("body") != "watch_event":
            raise BrokenReply(f"{envelope.WhichOneof('body')} within a watch")
        return envelope.watch_event
