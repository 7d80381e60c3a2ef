"""Who asks a daemon in a soak, and for what. All that they do keeps the atlas as large as it is."""

import itertools
import pathlib
import random
import urllib.request
from collections import deque

import atlas_pb2
from roadatlas import AtlasClient, TileStore, geometry

from bench_traffic import Actor

VEHICLES = 3
KEYFRAMES = 20  # of a session
KEPT = 2  # sessions of each vehicle that are whole; what is older is purged
FUSED_WITHIN_MS = 600_000
RADIUS_M = 60
CORRECTION_UM = 50_000
BACKUP_S = 25


class Street:
    """A drive that stays, and what vehicles add to it: each drives a piece of it again and again."""

    def __init__(self, keyframes, backups):
        self.keyframes, self.backups = keyframes, pathlib.Path(backups)
        self.finished = [deque() for _ in range(VEHICLES)]

    def fill(self, atlas):
        with AtlasClient(port=int(atlas.port), client_name="soak") as client:
            client.upload_keyframes([keyframe.upload("base", "drive", i) for i, keyframe in enumerate(self.keyframes)])
            client.wait(FUSED_WITHIN_MS)

    def piece(self, vehicle):
        first = vehicle * len(self.keyframes) // VEHICLES
        return self.keyframes[first:first + KEYFRAMES]

    def area(self, radius_m=RADIUS_M):
        return geometry.disc(*random.choice(self.keyframes).place_m, radius_m)


def actors_of(atlas, street, failures):
    """Each has its own pace, in seconds from the end of one act to the next."""
    def actor(name, period_s, act):
        return Actor(atlas.port, failures, name, period_s, act)
    return [*(actor(f"car.{i}", 1, vehicle_act(street, i)) for i in range(VEHICLES)),
            actor("operator", 1, operator_act(street)),
            actor("follower", 0.5, follower_act(street)),
            actor("newcomer", 1, lambda _: newcomer_act(atlas, street)),
            actor("query", 0.2, lambda client: query_act(client, street)),
            actor("watcher", 1, lambda client: watch_act(client, street)),
            actor("scraper", 5, lambda _: scrape_act(atlas)),
            actor("backup", BACKUP_S, backup_act(street))]


def vehicle_act(street, vehicle):
    """A keyframe, and the session that it ends."""
    name, piece = f"car.{vehicle}", street.piece(vehicle)
    numbers = itertools.count()
    waiting = []

    def act(client):
        if not waiting:
            number = next(numbers)
            waiting.extend((number, i) for i in range(len(piece)))
        number, i = waiting[0]
        client.upload_keyframe(piece[i].upload(name, f"drive.{number}", i))
        waiting.pop(0)
        if not waiting:
            street.finished[vehicle].append((name, f"drive.{number}"))
    return act


def operator_act(street):
    """In turns: poses are corrected and put back, a session is retracted and restored, old ones are purged, lists are
    read. One operator, so that nobody corrects what somebody else purges."""
    turns = itertools.count()
    change = atlas_pb2.ChangeSession

    def act(client):
        turn = next(turns)
        vehicle = turn // 6 % VEHICLES
        sessions = street.finished[vehicle]
        if sessions:
            name, session = sessions[-1]
            match turn % 6:
                case 0 | 1:
                    correct(client, name, session, street.piece(vehicle), CORRECTION_UM * (1 - turn % 6))
                case 2:
                    client.change_session(name, session, change.RETRACT, "soak")
                case 3:
                    client.change_session(name, session, change.RESTORE, "soak")
                case 4:
                    client.sessions(), client.log(), client.status()
        while len(sessions) > KEPT:
            client.change_session(*sessions[0], change.PURGE, "soak")
            sessions.popleft()
    return act


def correct(client, vehicle, session, piece, by_um):
    client.update_poses([atlas_pb2.PoseUpdate(key=upload.key, pose=upload.pose) for upload in (
        keyframe.upload(vehicle, session, i, (by_um, 0)) for i, keyframe in enumerate(piece))], "soak")


def follower_act(street):
    """Keeps a map of the middle of the street, with what changes as differences."""
    store = TileStore()
    around = atlas_pb2.SyncRequest(
        area=geometry.disc(*street.keyframes[len(street.keyframes) // 2].place_m, RADIUS_M))
    return lambda client: list(store.synchronize(client, around))


def newcomer_act(atlas, street):
    """Connects without a map, and takes a few hundred kilobytes of it."""
    with AtlasClient(port=int(atlas.port), client_name="newcomer") as client:
        client.sync(atlas_pb2.SyncRequest(area=street.area(), budget_bytes=1 << 19))


def query_act(client, street):
    place = random.choice(street.keyframes).pose
    client.query_region(atlas_pb2.QueryRegion(
        disc=atlas_pb2.QueryRegion.Disc(x_um=place.x_um, y_um=place.y_um, radius_um=geometry.micrometres(10)),
        coarsest_level=1))


def watch_act(client, street):
    with client.watch(street.area(), interval_ms=100) as watch:
        for _ in range(5):
            watch.next(1)


def scrape_act(atlas):
    """All that whoever looks after it looks at; a daemon that says that it is not ready is a failure."""
    for page in ("healthz", "readyz", "metrics"):
        with urllib.request.urlopen(f"http://{atlas.http}/{page}", timeout=10) as reply:
            reply.read()


def backup_act(street):
    numbers = itertools.count()

    def act(client):
        name = f"soak.{next(numbers)}"
        client.backup(name, FUSED_WITHIN_MS, author="soak")
        (street.backups / name).unlink()
    return act
