"""The pictures of the localization bench."""

import math

COLORS = {"atlas": "tab:blue", "paper": "tab:orange", "raw": "tab:green"}
NAMES = {"atlas": "ours", "paper": "paper mode", "raw": "raw returns, ICP"}


def pyplot():
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot as plot
    return plot


def distribution(values):
    values = sorted(values)
    return values, [(i + 1) / len(values) for i in range(len(values))]


def draw_shots(results, records, path):
    plot = pyplot()
    figure, axes = plot.subplots(2, 2, figsize=(12, 8.5))
    compared = [shots for shots in results if shots.setting["segments"] == 8 and shots.setting["cell_m"] == 0.2
                and shots.setting["range_m"] == 40]
    for shots in compared:
        rings, color = shots.setting["rings"], COLORS[shots.mode]
        axes[0, 0].plot(*distribution([row["error_m"] for row in shots.rows]), "-" if rings == 16 else "--", color=color,
                        label=f"{NAMES[shots.mode]}, {rings} rings")
        axes[0, 1].scatter(shots.cpu_ms(), shots.rmse("error_m"), color=color, marker="o" if rings == 16 else "s", s=60)
        axes[0, 1].annotate(f"{NAMES[shots.mode]}, {rings}", (shots.cpu_ms(), shots.rmse("error_m")), fontsize=8,
                            xytext=(0, 7), textcoords="offset points", ha="center")
    axes[0, 0].set(xscale="log", xlabel="error, m", ylabel="share of shots", title="single shots")
    axes[0, 0].legend(fontsize=8)
    axes[0, 1].set(xscale="log", yscale="log", xlabel="CPU ms a scan", ylabel="RMSE, m",
                   title="what it costs (circles: 16 rings, squares: 64)")
    axes[0, 1].margins(0.25)
    rows = [record for record in records if record["rings"] == 16 and record["mode"] != "raw"]
    bars(axes[1, 0], [row for row in rows if row["cell_m"] == 0.2 and row["range_m"] == 40], "segments",
         lambda row: str(row["segments"]))
    bars(axes[1, 1], [row for row in rows if row["segments"] == 8], "cell m, range m",
         lambda row: f"{row['cell_m']}, {row['range_m']}")
    for axis in axes.flat:
        axis.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def bars(axis, rows, what, name_of):
    names = list(dict.fromkeys(name_of(row) for row in rows))
    paper = {name_of(row): row["paper_rmse_m"] for row in rows}
    series = [(NAMES[mode], COLORS[mode], {name_of(row): row["rmse_m"] for row in rows if row["mode"] == mode})
              for mode in ("atlas", "paper")] + [("the paper, on Apollo", "lightgray", paper)]
    for i, (label, color, values) in enumerate(series):
        axis.bar([k + 0.27 * (i - 1) for k in range(len(names))], [values[name] for name in names], 0.25, color=color,
                 label=label)
    axis.set_xticks(range(len(names)), names)
    axis.set(xlabel=what, ylabel="RMSE, m", ylim=(0.0, 1.3 * max(max(values.values()) for _, _, values in series)))
    axis.legend(fontsize=8)


def draw_tracks(tracks, path):
    plot = pyplot()
    figure, axes = plot.subplots(len(tracks), 1, figsize=(12, 2.6 * len(tracks)))
    for axis, track in zip(axes, tracks):
        scans = [int(row["scan"]) for row in track.rows]
        failed = [track.is_failure(row) for row in track.rows]
        for field, color in (("along_m", "tab:blue"), ("across_m", "tab:orange"), ("up_m", "tab:green")):
            axis.plot(scans, [math.nan if bad else float(row[field]) for row, bad in zip(track.rows, failed)],
                      color=color, linewidth=1.1, label=field[:-2])
        bad = [scan for scan, is_bad in zip(scans, failed) if is_bad]
        if bad:
            axis.scatter(bad, [0.0] * len(bad), marker="|", s=40, color="tab:red", label="failed")
        for row in track.rows:
            if row["restart"] == "1":
                axis.axvline(int(row["scan"]), color="gray", linewidth=1.5)
        record = track.record()
        error = f"RMSE {record['rmse_m']} m" if track.hits else "none located"
        axis.set_title(f"{track.title.replace('`', '')}: {error}, {record['failures']} failed", fontsize=10)
        axis.set_ylabel("error, m")
        axis.grid(alpha=0.3)
    axes[0].legend(fontsize=8, ncol=3)
    axes[-1].set_xlabel("scan (red: failed; gray: tracking begins again after a jump)")
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def draw_covariance(results, tracks, path):
    """Shares of shots below a normalised error, against chi-squared with four degrees of freedom."""
    plot = pyplot()
    figure, axis = plot.subplots(figsize=(7.5, 5))
    shots = {shots.setting["rings"]: shots for shots in results if shots.mode == "atlas"
             and shots.setting["segments"] == 8 and shots.setting["cell_m"] == 0.2 and shots.setting["range_m"] == 40}
    for rings, found in shots.items():
        if found.nees():
            axis.plot(*distribution(found.nees()), label=f"single shots, {rings} rings")
    for track in tracks:
        if track.nees():
            axis.plot(*distribution(track.nees()), linewidth=1, label=track.title.replace("`", ""))
    x = [0.01 * 1.05 ** i for i in range(180)]
    axis.plot(x, [1.0 - math.exp(-value / 2) * (1.0 + value / 2) for value in x], "k--", label="honest")
    axis.axvline(9.4877, color="gray", linewidth=1)
    axis.set(xscale="log", xlim=(0.02, 300), xlabel="normalised error squared (line: 95 % of an honest covariance)",
             ylabel="share of scans")
    axis.grid(alpha=0.3)
    axis.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
