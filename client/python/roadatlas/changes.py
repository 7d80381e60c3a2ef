"""What a watch tells (docs/protocol.md, Watch), and how events that nobody fetched become one."""

import dataclasses

import atlas_pb2

from roadatlas.errors import BrokenReply

MAX_TOLD = 1024  # changes in one event; more become `anything`


@dataclasses.dataclass(frozen=True)
class Changes:
    """What changed in an area since the event before. `tiles`: the revisions of those that changed; `removed`: those
    that are no more. `below`: under these tiles some finer ones changed; `anything`: look at the whole area."""

    revision: int
    tiles: dict[int, int]
    removed: list[int]
    below: list[int]
    anything: bool


def changes_of(event: atlas_pb2.WatchEvent) -> Changes:
    if len(event.keys) != len(event.revisions):
        raise BrokenReply(f"an event with {len(event.keys)} tiles and {len(event.revisions)} revisions")
    told = dict(zip(event.keys, event.revisions))
    return Changes(event.revision, {key: revision for key, revision in told.items() if revision},
                   [key for key, revision in told.items() if not revision], list(event.below), event.anything)


def merge_events(earlier: atlas_pb2.WatchEvent, later: atlas_pb2.WatchEvent) -> None:
    """`earlier` tells both: every tile once, as it is now, and no more than MAX_TOLD changes."""
    told = dict(zip(earlier.keys, earlier.revisions)) | dict(zip(later.keys, later.revisions))
    below = sorted({*earlier.below, *later.below})
    anything = earlier.anything or later.anything or len(told) + len(below) > MAX_TOLD
    earlier.Clear()
    earlier.revision = later.revision
    earlier.anything = anything
    if not anything:
        earlier.keys.extend(told)
        earlier.revisions.extend(told.values())
        earlier.below.extend(below)
