"""`python3 -m roadatlas`: looks at a daemon from the command line (docs/python.md)."""

import argparse
import os
import pathlib
import sys

import atlas_pb2

from roadatlas.client import AtlasClient, SyncReply
from roadatlas.errors import RoadAtlasError
from roadatlas.geometry import disc, tile_place
from roadatlas.profile import parse_profile
from roadatlas.tile_store import TileStore

DEFAULT_SERVER = "127.0.0.1:7447"


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="roadatlas", description="Looks at a Road Atlas daemon.")
    parser.add_argument("--server", metavar="HOST:PORT", default=os.environ.get("ATLAS_SERVER", DEFAULT_SERVER),
                        help=f"the daemon [ATLAS_SERVER, else {DEFAULT_SERVER}]")
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("status", help="what the atlas holds")
    sync = commands.add_parser("sync", help="fetch the tiles of an area, coarse first")
    sync.add_argument("--disc", nargs=3, type=float, required=True, metavar=("X", "Y", "R"), help="metres")
    sync.add_argument("--out", type=pathlib.Path, required=True, metavar="DIR", help="a file LEVEL_X_Y.tile a tile")
    sync.add_argument("--finest", type=int, default=0, metavar="LEVEL", help="the finest level wanted [0]")
    sync.add_argument("--sections", type=int, nargs="+", default=[], metavar="ID",
                      help="of docs/formats/tile.md [all]")
    sync.add_argument("--budget", type=int, default=0, metavar="BYTES", help="of each reply [none]")
    return parser.parse_args()


def print_status(client: AtlasClient) -> None:
    hello = client.hello
    print(f"protocol {hello.protocol_major}.{hello.protocol_minor}, atlas {hello.atlas_id.hex()}, epoch {hello.epoch}")
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
        level, x, y = tile_place(tile.key)
        print(f"tile {level}/{x}/{y}  {len(tile.blob)} bytes  revision {tile.revision}  error {error_mm / 1000:g} m")
    print(f"{len(reply.tiles)} tiles, {reply.end.bytes} bytes, revision {reply.end.revision}"
          f"{', more to come' if reply.end.cursor else ''}")


def main() -> int:
    arguments = parse_arguments()
    host, _, port = arguments.server.rpartition(":")
    if not port.isdigit():
        print(f"roadatlas: --server {arguments.server}: expected HOST:PORT", file=sys.stderr)
        return 2
    try:
        with AtlasClient(host, int(port)) as client:
            if arguments.command == "status":
                print_status(client)
            else:
                sync_area(client, arguments)
    except (RoadAtlasError, OSError) as error:
        print(f"roadatlas: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
