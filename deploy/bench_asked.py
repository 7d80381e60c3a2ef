"""Figures that have to be what was asked: deploy/bench.sh exits with 1 if one is not."""

LONG = False  # with --long


class NotAsAsked(Exception):
    """Names the figures."""


class Asked:
    """Prints each figure as it comes; the end of the block tells which ones miss what was asked."""

    def __init__(self, emit):
        self.emit, self.missed = emit, []

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        if kind is None and self.missed:
            raise NotAsAsked(", ".join(self.missed))

    def at_most(self, name, value, unit, limit):
        self.emit(name, value, unit, f"asked at most {limit}", limit)
        if value > limit:
            self.missed.append(name)

    def at_least(self, name, value, unit, limit):
        self.emit(name, value, unit, f"asked at least {limit}", limit)
        if value < limit:
            self.missed.append(name)
