"""`python3 -m roadatlas`: looks at a daemon from the command line (docs/python.md)."""

import argparse
import sys
import time

import atlas_pb2

from roadatlas.changes import Changes
from roadatlas.client import AtlasClient
from roadatlas.command_line import connect, parse_arguments
from roadatlas.errors import BadCredentials, PlaintextRefused, RoadAtlasError
from roadatlas.geometry import disc, tile_place
from roadatlas.profile import parse_profile
from roadatlas.sync_reply import SyncReply
from roadatlas.tile_store import TileStore

_LOOK_AGAIN_S = 60.0


def print_status(client: AtlasClient, _: argparse.Namespace) -> None:
    hello = client.hello
    print(f"protocol {hello.protocol_major}.{hello.protocol_minor}, atlas {hello.atlas_id.hex()}, epoch {hello.epoch}")
    print(f"taken for {client.name or 'nobody in particular'}, role {client.role}")
    status = client.status()
    for field in status.DESCRIPTOR.fields:
        print(f"{field.name:16} {getattr(status, field.name)}")


def sync_area(client: AtlasClient, arguments: argparse.Namespace) -> None:
    arguments.out.mkdir(parents=True, exist_ok=True)
    profile = parse_profile(client.hello.profile)
    store = TileStore()
    request = atlas_pb2.SyncRequest(area=disc(*arguments.disc), finest_level=arguments.finest,
                                    sections=arguments.sections, budget_bytes=arguments.budget)
    for reply in store.synchronize(client, request):
        print_reply(reply)
    if reply.end.cursor:
        print("roadatlas: the budget has no room for the next tile", file=sys.stderr)
    for key, tile in sorted(store.tiles.items()):
        level, x, y = tile_place(key)
        (arguments.out / f"{level}_{x}_{y}.tile").write_bytes(tile.blob)
    for level in sorted({tile_place(key)[0] for key in store.tiles}):
        sizes = [len(tile.blob) for key, tile in store.tiles.items() if tile_place(key)[0] == level]
        print(f"level {level}: {len(sizes)} tiles of {profile.tile_side_m(level):g} m, {sum(sizes)} bytes")


def print_reply(reply: SyncReply) -> None:
    errors = [error for manifest in reply.manifests for error in manifest.errors_mm]
    for tile, error_mm in zip(reply.tiles, errors):
        print(f"tile {name_of(tile.key)}  {len(tile.blob)} bytes  revision {tile.revision}  "
              f"error {error_mm / 1000:g} m")
    print(f"{len(reply.tiles)} tiles, {reply.end.bytes} bytes, revision {reply.end.revision}"
          f"{', more to come' if reply.end.cursor else ''}")


def watch_area(client: AtlasClient, arguments: argparse.Namespace) -> None:
    until = None if arguments.seconds is None else time.monotonic() + arguments.seconds
    with client.watch(disc(*arguments.disc), finest_level=arguments.finest,
                      interval_ms=round(1000 * arguments.interval)) as watch:
        print(f"from revision {watch.since} on", flush=True)
        while until is None or time.monotonic() < until:
            changes = watch.next(_LOOK_AGAIN_S if until is None else max(0.0, until - time.monotonic()))
            if changes is not None:
                print_changes(changes)


def print_changes(changes: Changes) -> None:
    told = [f"changed {name_of(key)}" for key in changes.tiles] + [f"removed {name_of(key)}" for key in changes.removed]
    told += [f"changed below {name_of(key)}" for key in changes.below] + ["changed anything"] * changes.anything
    for line in told:
        print(f"revision {changes.revision}: {line}", flush=True)


def name_of(key: int) -> str:
    return "/".join(map(str, tile_place(key)))


def main() -> int:
    arguments = parse_arguments()
    try:
        with connect(arguments) as client:
            {"status": print_status, "sync": sync_area, "watch": watch_area}[arguments.command](client, arguments)
    except (BadCredentials, PlaintextRefused) as error:
        print(f"roadatlas: {error}", file=sys.stderr)
        return 2
    except (RoadAtlasError, OSError) as error:
        print(f"roadatlas: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
