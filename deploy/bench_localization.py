"""Localization: single shots by the product, by the paper's method and by ICP on raw returns, in one process a
setting; then whole drives tracked (bench_tracking). Leaves docs/results/localization.csv and .md and pictures."""

import csv
import math
import pathlib

import bench_localization_plot
import bench_tracking
from bench_daemon import rows_of

DOCS = pathlib.Path(__file__).parent.parent / "docs"
PIECES = ["00", "02", "04", "08"]  # map of the even scans, shots at the odd ones
TRIALS, FEWER_TRIALS = 20, 5       # a scan: 400 shots over the pieces at the default, 100 elsewhere
WITHIN_95 = 9.4877                 # chi-squared, 4 degrees of freedom
ELSEWHERE = {"atlas": (0.029, 0.066), "paper": (0.108, 0.36), "raw": (0.018, 0.058)}  # m, deg: other people's code

DEFAULT = {"rings": 16, "cell_m": 0.2, "range_m": 40, "segments": 8}
# The paper's tables, Apollo: (translation m, rotation deg, s a frame).
SEGMENTS = {2: (0.288, 1.106, 0.0792), 4: (0.281, 1.110, 0.0867), 8: (0.265, 1.073, 0.1011),
            16: (0.257, 1.002, 0.1305)}
RANGES = {(0.2, 40): (0.265, 1.073, 0.1011), (0.3, 60): (0.512, 0.976, 0.0908), (0.4, 80): (0.364, 0.886, 0.0817),
          (0.2, 60): (0.267, 0.963, 0.1506), (0.4, 40): (0.370, 1.078, 0.0807)}


class Shots:
    """Of one mode at one setting, all pieces."""

    def __init__(self, mode, setting, rows):
        self.mode, self.setting, self.rows = mode, setting, rows
        self.hits = [row for row in rows if not row["failed"]]

    def rmse(self, field):
        return math.sqrt(sum(row[field] ** 2 for row in self.hits) / max(1, len(self.hits)))

    def p95(self):
        errors = sorted(row["error_m"] for row in self.hits)
        return errors[(95 * len(errors) + 99) // 100 - 1] if errors else 0.0

    def cpu_ms(self):
        return sum(row["cpu_ms"] for row in self.rows) / len(self.rows)

    def nees(self):
        """Of all shots that are not called lost, however far off."""
        return [row["nees"] for row in self.rows if "nees" in row and row["health"] != "lost"]

    def record(self, paper):
        nees = self.nees()
        return {"mode": self.mode, **self.setting, "shots": len(self.rows),
                "failures": len(self.rows) - len(self.hits), "rmse_m": round(self.rmse("error_m"), 4),
                "rmse_deg": round(self.rmse("error_deg"), 4), "p95_m": round(self.p95(), 4),
                "cpu_ms": round(self.cpu_ms(), 1),
                "nees_per_freedom": round(sum(nees) / len(nees) / 4, 3) if nees else "",
                "within_95": round(sum(value <= WITHIN_95 for value in nees) / len(nees), 4) if nees else "",
                "paper_rmse_m": paper[0] if paper else "", "paper_rmse_deg": paper[1] if paper else "",
                "paper_ms": round(1e3 * paper[2], 1) if paper else ""}


def shoot(bin_dir, drive, setting, modes):
    rows = {mode: [] for mode in modes}
    trials = TRIALS if setting == DEFAULT else FEWER_TRIALS
    for piece in PIECES:
        for row in rows_of(bin_dir / "localization_bench", drive(f"semantickitti_mini/{piece}"), setting["rings"],
                           setting["cell_m"], setting["range_m"], setting["segments"], trials, ",".join(modes)):
            if "mode" in row:
                rows[row["mode"]].append(row)
    return [Shots(mode, setting, rows[mode]) for mode in modes]


def report(shots, emit):
    name = f"localization.{shots.mode}.{shots.setting['rings']}"
    metres, degrees = ELSEWHERE[shots.mode]
    who = {"atlas": "a prototype elsewhere, 16 rings", "paper": "the paper's method elsewhere, 16 rings",
           "raw": "GICP elsewhere, 16 rings"}[shots.mode]
    emit(name + ".translation_rmse", shots.rmse("error_m"), "m", who, metres)
    emit(name + ".rotation_rmse", shots.rmse("error_deg"), "deg", who, degrees)
    emit(name + ".translation_p95", shots.p95(), "m", "none", None)
    emit(name + ".failures", len(shots.rows) - len(shots.hits), f"of {len(shots.rows)}", "none", None)
    emit(name + ".cpu", shots.cpu_ms(), "ms a scan", "the paper", 101.1)
    nees = shots.nees()
    if nees:
        emit(name + ".nees", sum(nees) / len(nees) / 4, "a degree of freedom", "an honest covariance", 1.0)
        emit(name + ".within_95", sum(value <= WITHIN_95 for value in nees) / len(nees), "of shots",
             "an honest covariance", 0.95)


def table(records, columns):
    """Of (title, field) pairs, as Markdown."""
    lines = ["| " + " | ".join(title for title, _ in columns) + " |", "|---" * len(columns) + "|"]
    for record in records:
        lines.append("| " + " | ".join(str(record[field]) for _, field in columns) + " |")
    return "\n".join(lines) + "\n"


ERRORS = [("mode", "mode"), ("shots", "shots"), ("RMSE m", "rmse_m"), ("RMSE deg", "rmse_deg"), ("95 % m", "p95_m"), ("failed", "failures"),
          ("ms a scan", "cpu_ms")]
PAPERS = [("paper: m", "paper_rmse_m"), ("paper: deg", "paper_rmse_deg"), ("paper: ms", "paper_ms")]


def write_tables(records, tracks, path):
    def chosen(**values):
        return [record for record in records if all(record[key] == value for key, value in values.items())]

    ours = {key: value for key, value in DEFAULT.items() if key != "rings"}
    compared = [record for record in records if all(record[key] == value for key, value in ours.items())]
    segments = [record for record in chosen(rings=16, cell_m=0.2, range_m=40) if record["mode"] != "raw"]
    ranges = [record for pair in RANGES for record in chosen(rings=16, cell_m=pair[0], range_m=pair[1], segments=8)
              if record["mode"] != "raw"]
    text = f"""# Localization in figures

Written by `deploy/bench.sh localization`; what stands behind them is in `../results.md`. Single
shots over the four labelled pieces: map of the even scans, shots at the odd ones from starts up to 0.4 m and
1.5 degrees off. 16 of 64 rings unless said, 0.2 m cells, 40 m, columns of 8 m in 8 segments. *raw*: point-to-plane
ICP on all returns of the even scans. CPU time of one thread, from raw scan to pose. *paper:* is the paper's own
figure on Apollo, on other data and another machine. Also as [CSV](localization.csv).

## Three methods

{table(compared, [("rings", "rings"), *ERRORS, ("NEES a freedom", "nees_per_freedom"), ("within 95 %", "within_95")])}
![Errors and times](../images/localization.png)

## Segments of a column

{table(segments, [("segments", "segments"), *ERRORS, *PAPERS])}
## Cells and range

{table(ranges, [("cell m", "cell_m"), ("range m", "range_m"), *ERRORS, *PAPERS])}
## Whole drives

{table(tracks, bench_tracking.COLUMNS)}
![Errors along the drives](../images/localization_tracks.png)

![The covariance against the errors](../images/localization_covariance.png)
"""
    path.write_text(text, encoding="ascii")


def settings():
    """(setting, modes, the paper's figures), each once."""
    yield DEFAULT, ["atlas", "paper", "raw"], SEGMENTS[8]
    yield {**DEFAULT, "rings": 64}, ["atlas", "paper", "raw"], None
    for segments, paper in SEGMENTS.items():
        if segments != DEFAULT["segments"]:
            yield {**DEFAULT, "segments": segments}, ["atlas", "paper"], paper
    for (cell_m, range_m), paper in RANGES.items():
        if (cell_m, range_m) != (DEFAULT["cell_m"], DEFAULT["range_m"]):
            yield {**DEFAULT, "cell_m": cell_m, "range_m": range_m}, ["atlas", "paper"], paper


def bench_localization(bin_dir, emit, drive):
    results, records = [], []
    for setting, modes, paper in settings():
        for shots in shoot(bin_dir, drive, setting, modes):
            results.append(shots)
            records.append(shots.record(paper))
            if {**setting, "rings": 16} == DEFAULT:
                report(shots, emit)
    by_mode = {shots.mode: shots for shots in results if shots.setting == DEFAULT}
    emit("localization.speed", by_mode["raw"].cpu_ms() / by_mode["atlas"].cpu_ms(), "times that of raw ICP", "none", None)
    tracks = bench_tracking.track_all(bin_dir, emit, drive)
    (DOCS / "results").mkdir(exist_ok=True)
    with open(DOCS / "results/localization.csv", "w", newline="", encoding="ascii") as file:
        writer = csv.DictWriter(file, records[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(records)
    records.sort(key=lambda record: (record["rings"], record["segments"]))
    write_tables(records, [track.record() for track in tracks], DOCS / "results/localization.md")
    bench_localization_plot.draw_shots(results, records, DOCS / "images/localization.png")
    bench_localization_plot.draw_tracks(tracks, DOCS / "images/localization_tracks.png")
    bench_localization_plot.draw_covariance(results, tracks, DOCS / "images/localization_covariance.png")


BENCHMARKS = {"localization": bench_localization}
