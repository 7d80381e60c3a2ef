"""Places as the protocol has them: areas and poses from metres, tile keys (docs/protocol.md)."""

import math
from collections.abc import Iterable, Sequence

import atlas_pb2

_HALF = 1 << 28  # added to a tile's x and y
_LEVEL_SHIFT = 58
_BLOCK_BITS = 6

Place = tuple[float, float]


def micrometres(metres: float) -> int:
    return round(metres * 1e6)


def pose(position_m: Sequence[float], quaternion_wxyz: Sequence[float] = (1, 0, 0, 0)) -> atlas_pb2.Pose:
    """T_world_sensor; the quaternion need not be of length 1."""
    length = math.copysign(math.hypot(*quaternion_wxyz), quaternion_wxyz[0])
    w, x, y, z = (round(part / length * 2**30) for part in quaternion_wxyz)
    x_um, y_um, z_um = map(micrometres, position_m)
    return atlas_pb2.Pose(x_um=x_um, y_um=y_um, z_um=z_um, qw=w, qx=x, qy=y, qz=z)


def disc(x_m: float, y_m: float, radius_m: float) -> atlas_pb2.Area:
    return atlas_pb2.Area(disc=atlas_pb2.Area.Disc(center=_point((x_m, y_m)), radius_um=micrometres(radius_m)))


def box(min_m: Place, max_m: Place) -> atlas_pb2.Area:
    return atlas_pb2.Area(box=atlas_pb2.Area.Box(min=_point(min_m), max=_point(max_m)))


def corridor(route_m: Iterable[Place], half_width_m: float) -> atlas_pb2.Area:
    """All within half a width of a route that begins where the vehicle is."""
    route = [_point(place) for place in route_m]
    return atlas_pb2.Area(corridor=atlas_pb2.Area.Corridor(route=route, half_width_um=micrometres(half_width_m)))


def tiles(keys: Iterable[int]) -> atlas_pb2.Area:
    return atlas_pb2.Area(tiles=atlas_pb2.Area.Tiles(keys=sorted(keys)))


def tile_key(level: int, x: int, y: int) -> int:
    return level << _LEVEL_SHIFT | _spread(x + _HALF) | _spread(y + _HALF) << 1


def tile_place(key: int) -> tuple[int, int, int]:
    """Level, x and y of a key."""
    return key >> _LEVEL_SHIFT, _gather(key) - _HALF, _gather(key >> 1) - _HALF


def parent_key(key: int) -> int:
    level, x, y = tile_place(key)
    return tile_key(level + 1, x >> 1, y >> 1)


def block_of(key: int) -> int:
    """The block of 8 x 8 tiles that holds a tile; its tiles are those with keys `block << 6 | i`."""
    return key >> _BLOCK_BITS


def index_in_block(key: int) -> int:
    return key & ((1 << _BLOCK_BITS) - 1)


def _point(place: Place) -> atlas_pb2.Area.Point:
    return atlas_pb2.Area.Point(x_um=micrometres(place[0]), y_um=micrometres(place[1]))


def _spread(value: int) -> int:
    return sum((value >> i & 1) << 2 * i for i in range(_LEVEL_SHIFT // 2))


def _gather(value: int) -> int:
    return sum((value >> 2 * i & 1) << i for i in range(_LEVEL_SHIFT // 2))
