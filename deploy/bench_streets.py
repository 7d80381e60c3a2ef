"""A street network to simulate a city along: 2 km by 0.6 km, streets that bend and climb, a drive through all."""

import math
import random

LENGTH_M, WIDTH_M = 2000.0, 600.0
COLUMNS, ROWS = 7, 3        # crossings
JITTER_M = 35.0             # of a crossing from its place on the lattice
BOW_M = 12.0                # of a street from the straight line between its crossings
CORNER_M = 9.0              # before a crossing a turn begins
STEP_M = 0.5                # between poses
SENSOR_M = 1.8              # above the ground
CLOSED = 0.15               # of the lattice's streets are none


def ground_m(x, y):
    """Hills of a few metres, up to 5 percent steep."""
    return 6.0 * math.sin(x / 190.0) * math.cos(y / 160.0) + 3.0 * math.sin((x + 2 * y) / 340.0)


def network(rng):
    """Crossings by (column, row), and each one's neighbours."""
    places, streets = {}, {}
    for column in range(COLUMNS):
        for row in range(ROWS):
            places[column, row] = (column * LENGTH_M / (COLUMNS - 1) + rng.uniform(-JITTER_M, JITTER_M),
                                   row * WIDTH_M / (ROWS - 1) + rng.uniform(-JITTER_M, JITTER_M))
            streets[column, row] = []
    for column, row in places:
        for other in ((column + 1, row), (column, row + 1)):
            is_rim = row == other[1] and row in (0, ROWS - 1) or column == other[0] and column in (0, COLUMNS - 1)
            if other in places and (is_rim or rng.random() >= CLOSED):
                streets[column, row].append(other)
                streets[other].append((column, row))
    return places, streets


def tour(streets, rng):
    """Crossings in the order of a drive along every street, on untravelled ones where there are any."""
    left = {frozenset((a, b)) for a in streets for b in streets[a]}
    way = [min(streets)]
    while left:
        fresh = [b for b in streets[way[-1]] if frozenset((way[-1], b)) in left]
        leg = [rng.choice(fresh)] if fresh else to_fresh(streets, left, way)
        for crossing in leg:
            left.discard(frozenset((way[-1], crossing)))
            way.append(crossing)
    return way


def to_fresh(streets, left, way):
    """The shortest way on to a crossing with an untravelled street, without turning back at once."""
    queue, seen = [[b] for b in streets[way[-1]] if len(way) < 2 or b != way[-2]], {way[-1]}
    for path in queue:
        if any(frozenset((path[-1], b)) in left for b in streets[path[-1]]):
            return path
        for b in streets[path[-1]]:
            if b not in seen:
                seen.add(b)
                queue.append([*path, b])
    return [way[-2]]


def street_points(a, b):
    """Metre by metre from a to b, bowed to one side: the same street whichever way it is driven."""
    (ax, ay), (bx, by) = min(a, b), max(a, b)
    length = math.hypot(bx - ax, by - ay)
    bow = BOW_M * math.sin(ax + by)
    points = []
    for i in range(int(length) + 1):
        t = i / length
        side = bow * math.sin(math.pi * t) ** 2
        points.append((ax + (bx - ax) * t - (by - ay) / length * side, ay + (by - ay) * t + (bx - ax) / length * side))
    return points if a < b else points[::-1]


def rounded(before, after):
    """The turn from the end of one street into the next: a quadratic curve about the crossing."""
    cut = int(CORNER_M)
    p, q = before[-1 - cut], after[cut]
    middle = before[-1]
    turn = []
    for i in range(1, 2 * cut):
        t = i / (2 * cut)
        turn.append(tuple((1 - t) ** 2 * p[k] + 2 * t * (1 - t) * middle[k] + t ** 2 * q[k] for k in (0, 1)))
    return turn


def resampled(points):
    out, left = [], 0.0
    for (ax, ay), (bx, by) in zip(points, points[1:]):
        length = math.hypot(bx - ax, by - ay)
        while left < length:
            t = left / length
            out.append((ax + (bx - ax) * t, ay + (by - ay) * t))
            left += STEP_M
        left -= length
    return out


def drive(seed=1):
    """Poses as in poses.txt: 3x4 row-major, sensor to world."""
    rng = random.Random(seed)
    places, streets = network(rng)
    way = [places[crossing] for crossing in tour(streets, rng)]
    legs = [street_points(a, b) for a, b in zip(way, way[1:])]
    cut = int(CORNER_M)
    points = legs[0][:-cut]
    for before, after in zip(legs, legs[1:]):
        points += rounded(before, after) + after[cut:-cut]
    points = resampled(points)
    lines = []
    for (x, y), (nx, ny) in zip(points, points[1:]):
        yaw = math.atan2(ny - y, nx - x)
        c, s = math.cos(yaw), math.sin(yaw)
        lines.append(f"{c:.9f} {-s:.9f} 0 {x:.6f} {s:.9f} {c:.9f} 0 {y:.6f} 0 0 1 {ground_m(x, y) + SENSOR_M:.6f}")
    return "\n".join(lines) + "\n", len(points) * STEP_M
