"""The benchmarks of deploy/bench.sh on what a change costs: fusion against its oracle, loop closures,
online updates, passes over the same place, growth with the map. Docs/results.md, "Updates"."""

import pathlib

from bench_daemon import rows_of

IMAGES = pathlib.Path(__file__).parent.parent / "docs/images"
WORLDS = ("street", "overpass", "garage")


def bench_speed(bin_dir, emit, drive):
    """Cell-observations a second on one core: from nothing, plainly (batch) and keeping surveys (cold), and from
    what is kept, against the oracle."""
    for row in rows_of(bin_dir / "speed_bench", *WORLDS, drive("kitti_0005")):
        name = f"speed.{row['drive']}"
        plain = row["plain_M_per_s"]
        emit(name + ".oracle", plain, "M cell-observations/s", "goal", 15.0)
        emit(name + ".batch", row["batch_M_per_s"], "M cell-observations/s", "the oracle", plain)
        emit(name + ".cold", row["cold_M_per_s"], "M cell-observations/s", "the oracle, asked 1.4", plain)
        emit(name + ".kept", row["kept_M_per_s"], "M cell-observations/s", "the oracle, asked 2.5", plain)
        emit(name + ".kept_bytes", row["surveys_bytes"] / 2**20, "MiB, largest tile", "none", None)


def bench_closure(bin_dir, emit, drive):
    """500 keyframes corrected in one batch, against building the tiles that they touch from nothing: the faster
    one of the daemon's way after a restart (cold), which keeps surveys and writes tiles, and a plain one (batch),
    which does neither and has every keyframe decoded once. With `cache_mib` as it is by default, and half of it."""
    asked = {"all_moved": 1.1, "one_pass_of_four": 0.5, "drive": None}
    trajectory = drive("kitti_trajectories") / "00.txt"
    runs = (("", (trajectory,)),
            (".cache_256_mib", ("--cache-mib", 256, trajectory, "all_moved", "one_pass_of_four")))
    for suffix, arguments in runs:
        for row in rows_of(bin_dir / "closure_bench", *arguments):
            emit_closure(emit, "closure." + row["case"] + suffix, row, asked[row["case"]])


def emit_closure(emit, name, row, goal):
    emit(name + ".cpu", row["cpu_s"], "s", "building these tiles anew" + (f", asked {goal}" if goal else ""),
         min(row["cold_cpu_s"], row["batch_cpu_s"]))
    emit(name + ".keyframes", row["keyframes"], "keyframes in the atlas", "none", None)
    for way in ("cold", "batch"):
        emit(f"{name}.{way}_cpu", row[way + "_cpu_s"], "s", "none", None)
    emit(name + ".tiles_marked", row["tiles_marked"], "tiles", "footprints", row["tiles_expected"])
    emit(name + ".built", row["built"], "tiles", "footprints and ancestors", row["with_ancestors"])
    if "queries" in row:
        emit(name + ".query_p99", row["query_ms_p99"], f"ms, of {row['queries']} meanwhile", "none", None)
        emit(name + ".acknowledged_max", row["acknowledged_ms_max"],
             f"ms, of {row['uploads']} uploads meanwhile", "none", None)
        emit(name + ".failed", row["failed"], "requests", "none", None)


def bench_online(bin_dir, emit, _):
    """Four vehicles, a keyframe a second each; draws docs/images/update_time.png."""
    curves = {}
    for world in WORLDS:
        for range_m in (20, 30):
            *arrivals, total = rows_of(bin_dir / "online_bench", world, range_m, 0)
            name = f"online.{world}.{range_m}m"
            emit(name + ".served_p50", total["served_ms_p50"], "ms", "none", None)
            emit(name + ".served_p99", total["served_ms_p99"], "ms", "goal", 1000.0)
            emit(name + ".acknowledged_p99", total["acknowledged_ms_p99"], "ms", "none", None)
            curves[world, range_m] = sorted((a["at_s"], a["served_ms"]) for a in arrivals)
    draw_online(curves, IMAGES / "update_time.png")


def bench_passes(bin_dir, emit, _):
    """The garage again and again; draws docs/images/passes.png. What has a goal is run three times, of
    which the middle one counts: what else the machine does moves single runs."""
    curves = {}
    for name, preset, vehicles, runs, asked in (("bounded", "bounded", 1, 3, 1.3),
                                                ("bounded_fleet", "bounded", 10, 1, None),
                                                ("strict", "strict", 1, 1, None)):
        all_runs = sorted((list(rows_of(bin_dir / "passes_bench", "garage", preset, 10, vehicles)) for _ in range(runs)),
                          key=lambda rows: rows[-1]["cpu_ms"] / rows[1]["cpu_ms"])
        curves[name] = all_runs[runs // 2]
        second, tenth = curves[name][1], curves[name][-1]
        ratios = ", ".join(f"{rows[-1]['cpu_ms'] / rows[1]['cpu_ms']:.2f}" for rows in all_runs)
        goal = f", asked {asked}, the middle one of {ratios}" if asked else ""
        emit(f"passes.{name}.second", second["cpu_ms"], "ms CPU a keyframe", "none", None)
        emit(f"passes.{name}.tenth", tenth["cpu_ms"], "ms CPU a keyframe", "the second pass" + goal,
             second["cpu_ms"])
        emit(f"passes.{name}.kept_bytes", tenth["kept_bytes"] / 2**20, "MiB", "the second pass",
             second["kept_bytes"] / 2**20)
        for what in ("database", "keyframe", "tile", "kept"):
            key = what + "_bytes_added"
            emit(f"passes.{name}.{key}", tenth[key] / 2**20, "MiB in the tenth pass", "the second pass",
                 second[key] / 2**20)
    draw_passes(curves, IMAGES / "passes.png")


def bench_corrections(bin_dir, emit, _):
    """Two keyframes corrected, of the oldest and the latest of up to 16 passes of one vehicle or of ten in turn:
    the first time that such a pass is touched, and later."""
    for world, vehicles in (("garage", 1), ("street", 10), ("garage", 10)):
        early = None
        for row in rows_of(bin_dir / "passes_bench", world, "bounded", 16, vehicles, "correct"):
            passes = row.get("corrected_after_pass")
            if passes not in (2, 4, 6, 8, 12, 16):
                continue
            early = early or row
            for what in ("oldest_first", "oldest", "latest_first", "latest"):
                emit(f"corrections.{world}.{vehicles}.{passes}.{what}", row[what + "_ms"] / 1000, "s CPU an update",
                     "after 2 passes", early[what + "_ms"] / 1000)


def bench_restarts(bin_dir, emit, _):
    """The first keyframe after a restart, in the garage, after up to 15 passes of one vehicle; and
    without surveys on disk, after up to 7."""
    for name, mode, passes in (("restarts", "restart", 16), ("restarts_cold", "restart-cold", 8)):
        rows = list(rows_of(bin_dir / "passes_bench", "garage", "bounded", passes, 1, mode))
        for row in rows:
            if row["pass"] in (2, 4, 8, 16):
                for what in ("cpu_ms_first", "wall_ms_first"):
                    emit(f"{name}.{row['pass']}.{what}", row[what], "ms", "pass 2", rows[1][what])


def bench_scaling(bin_dir, emit, _):
    """Ten keyframes corrected, in maps of 100, 1,000 and 10,000; as configured, and with little memory."""
    for survey_mib in (1024, 96):
        first = None
        for keyframes in (100, 1000, 10000):
            row, = rows_of(bin_dir / "scaling_bench", keyframes, survey_mib)
            first = first or row
            for what, unit in (("cpu_ms_p50", "ms CPU an update"), ("cpu_ms_p50_again", "ms CPU an update"),
                               ("cpu_ms_p50_restarted", "ms CPU an update"), ("tiles_per_update", "tiles"),
                               ("peak_mb", "MiB"), ("store_mb", "MiB")):
                emit(f"scaling.{survey_mib}_mib.{keyframes}.{what}", row[what], unit, "100 keyframes", first[what])


def new_plot(columns):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    return pyplot.subplots(1, columns, figsize=(12, 3.8))


def draw_online(curves, path):
    figure, axes = new_plot(len(WORLDS))
    for axis, world in zip(axes, WORLDS):
        for range_m, color in ((20, "tab:blue"), (30, "tab:orange")):
            points = curves[world, range_m]
            axis.plot([at_s for at_s, _ in points], [ms for _, ms in points], ".", markersize=3, color=color,
                      label=f"{range_m} m")
        axis.axhline(1000, color="tab:red", linewidth=0.8, linestyle="--")
        axis.set_yscale("log")
        axis.set_ylim(10, 3000)
        axis.set_title(world, fontsize=10)
        axis.set_xlabel("time, s")
        axis.grid(alpha=0.3, which="both")
    axes[0].set_ylabel("acknowledged to served, ms")
    axes[0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def draw_passes(curves, path):
    figure, axes = new_plot(3)
    figures = (("cpu_ms", 1.0, "CPU ms a keyframe"), ("kept_bytes", 2**-20, "kept surveys, MiB"),
               ("database_bytes_added", 2**-20, "added to the database, MiB (dashed: keyframes)"))
    for axis, (key, scale, title) in zip(axes, figures):
        for name, rows in curves.items():
            axis.plot([row["pass"] for row in rows], [scale * row[key] for row in rows], "-o", markersize=3,
                      label=name.replace("_", ", "))
        axis.set_title(title, fontsize=10)
        axis.set_xlabel("pass through the garage")
        axis.grid(alpha=0.3)
    for color, rows in enumerate(curves.values()):
        axes[2].plot([row["pass"] for row in rows], [2**-20 * row["keyframe_bytes_added"] for row in rows], "--",
                     color=f"C{color}", linewidth=0.9)
    for axis in axes:
        axis.set_ylim(bottom=0)
    axes[0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


BENCHMARKS = {"speed": bench_speed, "closure": bench_closure, "online": bench_online,
              "passes": bench_passes, "corrections": bench_corrections,
              "restarts": bench_restarts, "scaling": bench_scaling}
