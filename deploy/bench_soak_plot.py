"""The picture of a soak: what was sampled, over its time."""

CURVES = (("resident_mib", "resident, MiB"), ("log_mib", "atlas.db-wal, MiB"), ("used_mib", "database in use, MiB"),
          ("dirty_tiles", "dirty tiles"), ("descriptors", "open descriptors"), ("threads", "threads"))


def draw(rows, minutes, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(2, 3, figsize=(12, 6), sharex=True)
    at_min = [row["second"] / 60 for row in rows]
    for axis, (field, title) in zip(axes.flat, CURVES):
        axis.plot(at_min, [row[field] for row in rows], linewidth=0.8)
        axis.axvspan(minutes / 3, at_min[-1], color="tab:green", alpha=0.08)
        axis.set_title(title, fontsize=10)
        axis.set_ylim(bottom=0)
        axis.grid(alpha=0.3)
    for axis in axes[1]:
        axis.set_xlabel("minutes (green: what counts)")
    figure.tight_layout()
    figure.savefig(path, dpi=110)
