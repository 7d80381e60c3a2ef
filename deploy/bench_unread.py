"""The benchmark of deploy/bench.sh on memory that peers take who do not read what they asked for, beside an atlas of
more than 10,000 tiles. Docs/results.md, "Serving"."""

import subprocess
import time

from bench_daemon import Atlas
from bench_load import Beside

SIDE = 90  # tiles of the finest level along each side: 10,800 of all levels
SECONDS = 4  # until all have what they get, and after they have left
CROWDS = (("never_reads", 200, "asked for everything, 64 times"),
          ("holds_unread", 80, "hold as much as one may, all of it in the area"))  # at once: parts of 256 MiB


def bench_unread(bin_dir, emit, drive):
    """What peers take that read nothing, in all, and what is left of it when they have gone."""
    for hostility, peers, what in CROWDS:
        with Atlas(bin_dir) as atlas:
            subprocess.run([bin_dir / "wide_atlas", atlas.port, str(SIDE)], check=True)
            atlas.run("wait")
            tiles = atlas.metric("roadatlas_tiles")
            if tiles < 10_000:
                raise RuntimeError(f"{tiles} tiles")
            atlas.restart()  # without what fusion keeps
            before = atlas.resident_bytes()
            with Beside(bin_dir / "crowd_bench", atlas.port, 0, 0, peers, hostility) as crowd:
                time.sleep(SECONDS)
                if (there := atlas.metric("roadatlas_connections")) < peers:
                    raise RuntimeError(f"only {there} peers are there")
                name = f"unread.{peers}.{hostility}"
                emit_more(emit, name + ".memory", atlas, before, f"that {what}")
                for metric in ("queued_reply", "held"):
                    emit(f"{name}.{metric}", atlas.metric(f"roadatlas_{metric}_bytes") / 2**20, "MiB", "none", None)
                crowd.end()
            time.sleep(SECONDS)
            emit_more(emit, name + ".left", atlas, before, "that have gone")


def emit_more(emit, name, atlas, before, whose):
    emit(name, (atlas.resident_bytes() - before) / 2**20, f"MiB more than {before >> 20}", f"peers {whose}", None)


BENCHMARKS = {"unread": bench_unread}
