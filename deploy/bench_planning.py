"""Routes between random places of two maps, against a search over everything on the finest level: a city along
2 km by 0.6 km of streets and the garage of eight decks. Draws docs/images/planning.png."""

import json
import pathlib
import statistics
import subprocess
import tempfile

from bench_daemon import Atlas, rows_of
import bench_streets

IMAGE = pathlib.Path(__file__).parent.parent / "docs/images/planning.png"
PAIRS, SEED = 50, 1  # until so many have a route; nobody chose the seed for what it gives
EVERY_M = 3          # between scans of the city
LOSS, FEWER, WARM_MS, COLD_MS = 1.02, 10, 200, 1500  # what was asked


def bench_planning(bin_dir, emit, drive):
    with tempfile.TemporaryDirectory() as work:
        poses = pathlib.Path(work) / "streets.txt"
        text, metres = bench_streets.drive()
        poses.write_text(text)
        city = pathlib.Path(work) / "city"
        subprocess.run([bin_dir / "atlas", "simulate", "city", "--trajectory", poses, "--every", str(EVERY_M),
                        "-o", city], check=True, stdout=subprocess.DEVNULL)
        emit("planning.city.driven", metres, "m", "none", None)
        measure(bin_dir, emit, "city", city, draws=True)
        measure(bin_dir, emit, "garage", drive("sim_garage_A"))


def measure(bin_dir, emit, name, folder, draws=False):
    with Atlas(bin_dir) as atlas:
        atlas.run("ingest", folder)
        atlas.run("wait")
        atlas.stop()
        rows = list(rows_of(bin_dir / "planning_bench", atlas.database, PAIRS, SEED))
        emit_rows(f"planning.{name}", rows, emit)
        if draws:
            draw(bin_dir, atlas.database, rows)


def emit_rows(name, rows, emit):
    joined = [row for row in rows if row["all"]["found"]]
    both = [row for row in joined if row["warm"]["found"]]
    apart = [row for row in rows if not row["all"]["found"]]
    emit(f"{name}.missed", len(joined) - len(both), f"of {len(joined)} pairs with a route", "asked", None)
    emit(f"{name}.invented", sum(row["warm"]["found"] for row in apart), f"of {len(apart)} pairs without", "asked", None)
    emit(f"{name}.map", rows[0]["map_tiles"], "tiles of the finest level", "none", None)

    def both_ends(what, values, unit, asked, is_worst_high=True):
        worst = max if is_worst_high else min
        emit(f"{name}.{what}.median", statistics.median(values), unit, "asked", asked)
        emit(f"{name}.{what}.worst", worst(values), unit, "asked", asked)
        if asked:
            short = [v for v in values if (v > asked if is_worst_high else v < asked)]
            emit(f"{name}.{what}.not_as_asked", len(short), f"of {len(values)}", "none", None)

    both_ends("cost", [row["warm"]["searched_cost"] / row["all"]["searched_cost"] for row in both],
              "of an exhaustive search's", LOSS)
    both_ends("straightened", [row["warm"]["cost"] / row["all"]["cost"] for row in both],
              "of an exhaustive search's, straightened as well", LOSS)
    both_ends("fewer_expansions", [row["all"]["expansions"] / row["warm"]["expansions"] for row in both],
              "times", FEWER, is_worst_high=False)
    both_ends("decoded", [row["warm"]["ms"] for row in both], "ms", WARM_MS)
    both_ends("cold", [row["cold"]["ms"] for row in both], "ms", COLD_MS)
    both_ends("exhaustive", [row["all"]["ms"] for row in both], "ms", None)
    both_ends("length", [row["warm"]["length_m"] for row in both], "m", None)
    both_ends("expansions", [row["warm"]["expansions"] for row in both], "nodes of all levels", None)
    both_ends("tiles", [row["warm"]["tiles"] for row in both], "tiles of the finest level", None)
    both_ends("memory", [row["warm"]["memory_bytes"] / 1e6 for row in both], "MB", None)
    if apart:
        both_ends("without_route", [row["warm"]["ms"] for row in apart], "ms", None)


def draw(bin_dir, database, rows):
    """The longest of the routes, over the map."""
    row = max(rows, key=lambda row: row["warm"]["length_m"])
    with tempfile.TemporaryDirectory() as work:
        route = pathlib.Path(work) / "route.geojson"
        ends = [",".join(str(v) for v in row[end]) for end in ("from", "to")]
        subprocess.run([bin_dir / "atlas", "plan", f"--from={ends[0]}", f"--to={ends[1]}", "--atlas", database,
                        "--output", route], check=True, stdout=subprocess.DEVNULL)
        subprocess.run([bin_dir / "atlas", "render", "--atlas", database, "--path", route, "-o", IMAGE], check=True,
                       stdout=subprocess.DEVNULL)


BENCHMARKS = {"planning": bench_planning}

if __name__ == "__main__":  # rows of planning_bench, as JSON lines on stdin
    import sys
    emit_rows(sys.argv[1], [json.loads(line) for line in sys.stdin],
              lambda *row: print(*(f"{part:.5g}" if isinstance(part, float) else part for part in row)))
