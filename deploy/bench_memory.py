"""The benchmark of deploy/bench.sh on the memory of a daemon that serves: atlases of different sizes, filled with
copies of a real drive. Docs/results.md, "Serving"."""

import pathlib
import time

from bench_daemon import Atlas, Background, rows_of

LONG = False  # 5 GiB, too
NTH = 4  # keyframe: one every four metres or so, so that about half of the bytes are tiles
READ_S = 30
ROUNDS = 3


def memory_of(pid):
    """MiB by name: VmRSS, VmHWM, RssAnon, RssFile."""
    lines = pathlib.Path(f"/proc/{pid}/status").read_text().splitlines()
    fields = dict(line.split(":", 1) for line in lines)
    return {name: int(fields[name].split()[0]) / 1024 for name in ("VmRSS", "VmHWM", "RssAnon", "RssFile")}


class Watch(Background):
    """The most of each over a while."""

    def __init__(self, pid):
        super().__init__("watch")
        self.pid = pid
        self.most = memory_of(pid)

    def run(self):
        while not self.is_over.wait(0.2):
            for name, value in memory_of(self.pid).items():
                self.most[name] = max(self.most[name], value)


def serve(bin_dir, folder, gib, emit):
    """The most resident memory of a daemon that reads all over an atlas of that size."""
    name = f"memory.{gib:g}_gib"
    with Atlas(bin_dir) as atlas:
        started = time.monotonic()
        *_, filled = rows_of(bin_dir / "memory_bench", "fill", atlas.server, folder, round(gib * 1024), NTH)
        emit(f"{name}.filled_at", filled["store_bytes"] / 2**20 / (time.monotonic() - started), "MiB/s", "none", None)
        emit(f"{name}.keyframes", filled["keyframes"], "keyframes", "none", None)
        emit(f"{name}.tiles", filled["tiles"], "tiles", "none", None)
        emit(f"{name}.filling", memory_of(atlas.process.pid)["VmHWM"], "MiB, peak while it was filled", "none", None)
        atlas.restart()
        emit(f"{name}.idle", memory_of(atlas.process.pid)["VmRSS"], "MiB, started again", "none", None)
        for turn in range(ROUNDS):
            with Watch(atlas.process.pid) as watch:
                row, = rows_of(bin_dir / "memory_bench", "read", atlas.server, folder, filled["copies"], READ_S)
            emit(f"{name}.round_{turn}.tiles_per_s", row["tiles"] / READ_S, "tiles/s", "none", None)
            emit(f"{name}.round_{turn}.request", row["bytes"] / (row["syncs"] + row["queries"]) / 2**10,
                 "KiB, a request's tiles", "none", None)
            for field in ("VmRSS", "RssAnon", "RssFile"):
                emit(f"{name}.round_{turn}.{field}", watch.most[field], "MiB", "asked at most 256", 256)
        peak = memory_of(atlas.process.pid)["VmHWM"]
        emit(f"{name}.peak", peak, "MiB", "asked at most 256", 256)
        return peak


def bench_memory(bin_dir, emit, drive):
    """Resident memory at the default settings, sixteen vehicles that ask for random places without a pause."""
    folder = drive("kitti_0005")
    small = serve(bin_dir, folder, 0.5, emit)
    if LONG:
        large = serve(bin_dir, folder, 5.0, emit)
        emit("memory.growth", large, "MiB with 5 GiB", "0.5 GiB, asked 0.9 to 1.1", small)


BENCHMARKS = {"memory": bench_memory}
