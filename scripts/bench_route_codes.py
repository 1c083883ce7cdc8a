"""Time the route codes of Fig. 4 on this machine: one core, warm, medians.

    python scripts/bench_route_codes.py [--columns N]

What is compiled or imported for the first time is timed apart.
"""

from __future__ import annotations

import argparse
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from rigidpend import Body, route_codes
from rigidpend.integrate.compile_cache import processor_model

BODY = Body(A=(2, 1, "1.5"), r=(1, 1, 0), mu="0.001")
LEFT = [f"{k}/10" for k in range(63)]


def codes(phases: Any, **how: Any) -> Any:
    return route_codes(BODY, phases, h0="1.3342", J1_0="1e-8", **how)


def seconds(work: Callable[[], Any], repeats: int) -> list[float]:
    taken = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        taken.append(time.perf_counter() - start)
    return taken


def line(what: str, taken: list[float], unit: float = 1e3, name: str = "ms") -> None:
    low, middle, high = (f(taken) * unit for f in (min, statistics.median, max))
    print(f"{what:<52} {middle:9.2f} {name}   ({low:.2f} to {high:.2f}, {len(taken)} runs)")


def process(*arguments: str) -> Callable[[], Any]:
    command = [sys.executable, "-m", "rigidpend", *arguments]
    return lambda: subprocess.run(command, check=True, capture_output=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--columns", type=int, default=10_000, help="for the cost at scale")
    columns = parser.parse_args().columns

    print(processor_model())
    line("left array, first call (import, compile or cache)", seconds(lambda: codes(LEFT), 1))
    line("left array, taylor, one core", seconds(lambda: codes(LEFT), 15))
    line("left array, taylor, 53 bits alone", seconds(lambda: codes(LEFT, precisions=[53]), 15))
    line("one orbit, 113 bits twice", seconds(lambda: codes(LEFT[:1], precisions=[113]), 3))
    line("left array, scipy, one core", seconds(lambda: codes(LEFT, engine="scipy"), 1))

    phases = np.random.default_rng(0).uniform(0, 2 * np.pi, columns)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    taken = seconds(lambda: codes(phases), 1)
    line(f"{columns} random phases, one core, a column", taken, 1e3 / columns)
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    peak, was = after / 1024, before / 1024
    print(f"{'peak memory of this process':<52} {peak:9.0f} MB   (before: {was:.0f})")

    with tempfile.TemporaryDirectory() as folder:
        run = process("run", "fig4", "--force", "--out", folder)
        line("process: rigidpend run fig4", seconds(run, 7))
        line(
            "process: rigidpend run fig4, up to date",
            seconds(process("run", "fig4", "--out", folder), 5),
        )
        line(
            "process: rigidpend render fig4", seconds(process("render", "fig4", "--out", folder), 3)
        )
    line("process: rigidpend --help", seconds(process("--help"), 7))


if __name__ == "__main__":
    main()
