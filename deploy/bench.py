#!/usr/bin/python3
"""The benchmarks behind deploy/bench.sh. Each prints JSON lines; times are CPU time of one thread,
the median of five runs."""

import argparse
import importlib
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

import bench_asked
import bench_crowd
import bench_follow
import bench_kidnapped
import bench_load
import bench_localization
import bench_memory
import bench_monitoring
import bench_nginx
import bench_places
import bench_planning
import bench_serving
import bench_tracking
import bench_unread
import bench_updates
from bench_daemon import Atlas

PIECES = ["00", "02", "04", "08"]  # labelled real scans, docs/data.md
RUNS = 5


def emit(name, value, unit, against, reference):
    ratio = value / reference if reference else None
    print(json.dumps({"name": name, "value": round(value, 5), "unit": unit,
                      "against": against, "ratio": ratio and round(ratio, 4)}), flush=True)


def drive(name):
    data = os.environ.get("ATLAS_DATA")
    if not data or not (pathlib.Path(data) / name).is_dir():
        sys.exit(f"{name}: not in $ATLAS_DATA; docs/data.md says where the drives come from")
    return pathlib.Path(data) / name


def segment(bin_dir, folder, rings, mode):
    out = subprocess.run([bin_dir / "atlas", "segment", folder, "--rings", str(rings), "--mode", mode,
                          "--json"], check=True, stdout=subprocess.PIPE, text=True).stdout
    return json.loads(out)


def bench_segmentation(bin_dir):
    folders = [drive(f"semantickitti_mini/{piece}") for piece in PIECES]
    for rings, paper_f1 in ((16, 0.965), (64, 0.917)):
        for mode in ("atlas", "paper"):
            results = [segment(bin_dir, folder, rings, mode) for folder in folders]
            f1 = statistics.mean(result["f1"] for result in results)
            emit(f"segmentation.f1.{mode}.{rings}", f1, "1", "the paper's literal mode elsewhere",
                 paper_f1)
            time_ms = statistics.median(result["ms_per_scan"] for result in results)
            emit(f"segmentation.time.{mode}.{rings}", time_ms, "ms", "the paper, 16 rings", 13.7)


def bench_frontend(bin_dir):
    """Real scans, and the simulated garage's: a real VLP-16 returns as many points as the latter."""
    for name, folders in (("real", [f"semantickitti_mini/{piece}" for piece in PIECES]),
                          ("simulated", ["sim_garage_A"])):
        times = []
        for _ in range(RUNS):
            with Atlas(bin_dir) as atlas:
                times.append(statistics.mean(
                    atlas.run("ingest", drive(folder), "--session", f"s{i}", "--rings", 16, "--every", 0,
                              "--max-range", 20)["frontend_ms_per_scan"]
                    for i, folder in enumerate(folders)))
        emit(f"frontend.scan_to_blob.{name}", statistics.median(times), "ms",
             "the paper, 16 rings, 20 m", 46.2)


def bench_fusion(bin_dir):
    out = subprocess.run([bin_dir / "fusion_bench", "--benchmark_format=json",
                          f"--benchmark_repetitions={RUNS}", "--benchmark_report_aggregates_only=true"],
                         check=True, stdout=subprocess.PIPE, text=True).stdout
    for row in json.loads(out)["benchmarks"]:
        if row.get("aggregate_name") == "median":
            emit("fusion." + row["run_name"], row["cell_observations/s"] / 1e6, "M cell-observations/s",
                 "a straightforward version", 18.0)


def bench_accuracy(bin_dir):
    """Maps of simulated drives against the worlds that they were simulated in."""
    data = os.environ.get("ATLAS_DATA", "")
    worlds = ["street", "street_without_cars", "overpass", "garage", "garage_with_traffic", "garage_with_car_behind"]
    if (pathlib.Path(data) / "meshes").is_dir():
        worlds += ["mesh_garage", "mesh_garage_with_traffic", "mesh_garage_with_car_behind", "mesh_interchange"]
    else:
        print("accuracy: no meshes in $ATLAS_DATA, built-in worlds only", file=sys.stderr)
    process = subprocess.Popen([bin_dir / "accuracy_bench", "--data", data, *worlds], stdout=subprocess.PIPE,
                               text=True)
    for line in process.stdout:
        result = json.loads(line)
        name = "accuracy." + result["name"]
        emit(name + ".layers_right", result["layers_right"], f"of {result['cells']} cells", "goal", 0.99)
        emit(name + ".layers_real", result["layers_real"], f"of {result['cells']} cells", "none", None)
        emit(name + ".surfaces_found", result["surfaces_found"], f"of {result['surfaces']} surfaces", "none", None)
        emit(name + ".altitude_rmse", result["altitude_rmse_m"], "m, of those found", "goal", 0.03)
        emit(name + ".altitude_within_30mm", result["altitude_within_30mm"],
             f"of {result['surfaces']} surfaces", "none", None)
        if result["moving_cells"]:
            emit(name + ".moving_gone", result["moving_gone"], f"of {result['moving_cells']} cells", "goal", 0.99)
        emit(name + ".static_kept", result["static_kept"], f"of {result['static_cells']} cells", "goal", 0.98)
        emit(name + ".static_kept_nearby", result["static_kept_nearby"],
             f"of {result['static_cells']} cells", "none", None)
        for truth in ("free", "occupied"):
            for said, count in zip(("free", "occupied", "unknown"), result[truth]):
                emit(f"{name}.{truth}_called_{said}", count, "cells", f"all that are {truth}", sum(result[truth]))
    if process.wait():
        sys.exit(process.returncode)


def bench_curbs(bin_dir):
    """Kerbs over thresholds, simulated and real; draws docs/images/curbs.png."""
    rows = []
    with tempfile.TemporaryDirectory() as work:
        street = pathlib.Path(work) / "street"
        subprocess.run([bin_dir / "atlas", "simulate", "street", "-o", street, "--sensor", "hdl64"], check=True,
                       stdout=subprocess.DEVNULL)
        drives = {"simulated": [street], "real": [drive(f"semantickitti_mini/{piece}") for piece in PIECES]}
        for kind, folders in drives.items():
            for mode in ("atlas", "paper"):
                for rings in (16, 32, 64):
                    for threshold in CURB_THRESHOLDS:
                        rows.append(curb_rates(bin_dir, kind, folders, mode, rings, threshold))
                        print(json.dumps(rows[-1]), flush=True)
    draw_curbs(rows, pathlib.Path(__file__).parent.parent / "docs/images/curbs.png")


CURB_THRESHOLDS = [0.003, 0.005, 0.0075, 0.01, 0.015, 0.02, 0.03, 0.04, 0.05, 0.06, 0.08, 0.10, 0.12, 0.16,
                   0.20, 0.25, 0.30]


def curb_rates(bin_dir, kind, folders, mode, rings, threshold):
    """Cells of all folders pooled."""
    missed = curb = false = road = 0
    for folder in folders:
        out = subprocess.run([bin_dir / "atlas", "segment", folder, "--curbs", "--mode", mode, "--rings",
                              str(rings), "--threshold", str(threshold), "--json"], check=True,
                             stdout=subprocess.PIPE, text=True).stdout
        result = json.loads(out)
        curb += result["curb_cells"]
        road += result["road_cells"]
        missed += (result["missed_curb"] or 0) * result["curb_cells"]  # null of none
        false += (result["false_road"] or 0) * result["road_cells"]
    return {"name": f"curbs.{kind}.{mode}.{rings}", "threshold_m": threshold,
            "missed_curb": round(missed / curb, 5), "false_road": round(false / road, 5),
            "curb_cells": curb, "road_cells": road}


def draw_curbs(rows, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(1, 2, figsize=(11, 4.6), sharey=True)
    for axis, kind in zip(axes, ("simulated", "real")):
        for mode, style in (("atlas", "-o"), ("paper", "--s")):
            for rings, color in ((16, "tab:red"), (32, "tab:green"), (64, "tab:blue")):
                curve = [row for row in rows if row["name"] == f"curbs.{kind}.{mode}.{rings}"]
                axis.plot([100 * row["false_road"] for row in curve], [100 * row["missed_curb"] for row in curve],
                          style, color=color, markersize=3, linewidth=1.2, label=f"{mode}, {rings} rings")
                for row in curve:
                    if mode == "atlas" and row["threshold_m"] in (0.02, 0.05, 0.12, 0.3):
                        axis.annotate(f"{row['threshold_m']:g}", (100 * row["false_road"], 100 * row["missed_curb"]),
                                      fontsize=6, color=color)
        axis.set_xscale("log")
        axis.set_xlabel("road cells called obstacle, %")
        axis.set_title(f"kerbs, {kind} (numbers: threshold, m)", fontsize=10)
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("kerb cells called traversable, %")
    axes[1].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


PARTS = ("tracking",)  # of localization: by name alone
# With the client in Python, whose messages the build makes, or with numpy.
LATE = ("soak", "restart", "purge", "merge", "merge_priors")


def bench_late(name, bin_dir):
    importlib.import_module(f"bench_{name}").BENCHMARKS[name](bin_dir, emit, drive)


BENCHMARKS = {"segmentation": bench_segmentation, "frontend": bench_frontend,
              "fusion": bench_fusion, "accuracy": bench_accuracy,
              "curbs": bench_curbs,
              **{name: lambda bin_dir, bench=bench: bench(bin_dir, emit, drive)
                 for name, bench in {**bench_updates.BENCHMARKS, **bench_serving.BENCHMARKS,
                                   **bench_load.BENCHMARKS, **bench_follow.BENCHMARKS,
                                   **bench_memory.BENCHMARKS, **bench_planning.BENCHMARKS, **bench_unread.BENCHMARKS,
                                   **bench_crowd.BENCHMARKS, **bench_kidnapped.BENCHMARKS, **bench_localization.BENCHMARKS,
                                   **bench_monitoring.BENCHMARKS, **bench_places.BENCHMARKS,
                                   **bench_tracking.BENCHMARKS}.items()},
              **{name: lambda bin_dir, name=name: bench_late(name, bin_dir) for name in LATE}}


def main():
    parser = argparse.ArgumentParser(prog="deploy/bench.sh", description=__doc__)
    parser.add_argument("--bin", type=pathlib.Path, required=True, help=argparse.SUPPRESS)
    parser.add_argument("--nginx", default="nginx", help=argparse.SUPPRESS)
    parser.add_argument("--long", action="store_true", help="memory: with 5 GiB, too; soak: 90 minutes; merge: 10 km, too")
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(BENCHMARKS))
    args = parser.parse_args()
    unknown = [name for name in args.names if name not in BENCHMARKS]
    if unknown:
        parser.error(f"no benchmark {', '.join(unknown)}; there are {', '.join(BENCHMARKS)}")
    bench_nginx.PROGRAM = args.nginx
    bench_memory.LONG = bench_asked.LONG = args.long
    missed = []
    for name in args.names or [name for name in BENCHMARKS if name not in PARTS]:
        try:
            BENCHMARKS[name](args.bin)
        except bench_asked.NotAsAsked as miss:
            missed.append(str(miss))
    if missed:
        sys.exit(f"not as asked: {', '.join(missed)}")


if __name__ == "__main__":
    main()
