"""How long somebody who was not there before waits for his first answer, beside those who crowd at the door."""

import math
import socket
import threading
import time

NEWCOMERS = 40
VISITS_PER_S = 600
VISIT_S = 0.2
PATIENCE_S = 5  # of a client that connects


class Passers:
    """So many connections a second that say nothing and are closed after a while, whether the daemon took them or not."""

    def __init__(self, port, per_s=VISITS_PER_S, seconds=VISIT_S):
        self.address, self.per_s, self.seconds = ("127.0.0.1", int(port)), per_s, seconds
        self.visits, self.ended = 0, threading.Event()
        self.thread = threading.Thread(target=self.run)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.ended.set()
        self.thread.join()

    def run(self):
        began, there = time.monotonic(), []
        while not self.ended.is_set():
            now = time.monotonic()
            while self.visits < (now - began) * self.per_s:
                visitor = socket.socket()
                visitor.setblocking(False)
                visitor.connect_ex(self.address)
                there.append((now + self.seconds, visitor))
                self.visits += 1
            while there and there[0][0] <= now:
                there.pop(0)[1].close()
            time.sleep(0.002)
        for _, visitor in there:
            visitor.close()


def newcomer_waits(atlas, count=NEWCOMERS):
    """Seconds of each: a process that connects, says its Hello and has an answer."""
    waits = []
    for _ in range(count):
        began = time.monotonic()
        atlas.run("status")
        waits.append(time.monotonic() - began)
    return waits


def emit_newcomers(emit, name, atlas, crowd):
    """Beside a crowd, beside visits that say nothing, and alone."""
    with crowd:
        time.sleep(1)
        emit_waits(emit, f"{name}.newcomer.crowd", newcomer_waits(atlas))
    with Passers(atlas.port):
        time.sleep(2 * PATIENCE_S)  # what waits by then would be too much for a client's patience
        emit_waits(emit, f"{name}.newcomer.silent_visits", newcomer_waits(atlas))
    emit_waits(emit, f"{name}.newcomer.alone", newcomer_waits(atlas))


def emit_waits(emit, name, waits):
    p99 = sorted(waits)[math.ceil(0.99 * len(waits)) - 1]
    emit(f"{name}.p99", 1000 * p99, "ms until a newcomer has an answer, its process included",
         f"none, but below the {PATIENCE_S} s of a client", None)
