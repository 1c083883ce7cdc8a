"""A stop is a stop, whatever computes: work ends soon where a signal or Ctrl-C asks for it."""

import faulthandler
import os
import signal
import time
from collections.abc import Callable
from multiprocessing import active_children
from threading import Thread
from typing import Any

import numpy as np
import pytest

from rigidpend import route_codes
from rigidpend.machine import workers
from rigidpend.machine.signals import Stopped
from tests.bodies import FIG4

PROMPT = 2.0
"""Seconds of the processor within which work ends; without a check it takes ten times that."""
LONG: Any = (63, 100_000, {})
IN_THREADS: Any = (2, 63, 1_000, {"precisions": [113]})
WORK: list[Any] = [
    (2, *LONG),
    (2, 10_000, 300, {}),
    (2, 63, 3_000, {"precisions": [64]}),
    IN_THREADS,
    (2, 63, 1_000, {"precisions": [160]}),
    # In processes.
    (2, 63, 1_000, {"engine": "scipy", "precisions": [53]}),
    # On one thread it is the same calls that are waited for, of any work.
    (1, *LONG),
    (1, 63, 1_000, {"engine": "scipy", "precisions": [80]}),
]
"""Work of any kind: threads, columns, symbols, and how they are computed."""


def ends_soon(
    ask: Callable[[], object], end: Any, jobs: int, count: int, symbols: int, how: Any
) -> None:
    """Work that is asked to end does so by an exception of a kind."""

    def work(count: int, symbols: int) -> None:
        given = {"h0": "1.3342", "J1_0": "1e-8", "jobs": jobs, **how}
        route_codes(FIG4, np.arange(count) / 100, n_symbols=symbols, **given)

    asked: list[tuple[float, float]] = []

    def ask_at_work() -> None:
        # At work it takes time of the processor, or is in processes that do.
        begun = time.process_time()
        while time.process_time() < begun + 0.1 and not active_children():
            time.sleep(0.01)
        asked.append((time.process_time(), time.monotonic()))
        ask()

    work(1, 1)
    Thread(target=ask_at_work, daemon=True).start()
    # Where nobody heeds it the work takes hours.
    faulthandler.dump_traceback_later(300, exit=True)
    try:
        with pytest.raises(end):
            work(count, symbols)
    finally:
        faulthandler.cancel_dump_traceback_later()
    [(used, since)] = asked
    assert time.process_time() - used < PROMPT
    # Of processes, whose time is not counted here. Other work on the machine may take its turn.
    assert time.monotonic() - since < PROMPT * max(1.0, os.getloadavg()[0])


@pytest.mark.slow
@pytest.mark.parametrize(("jobs", "count", "symbols", "how"), WORK)
def test_work_of_any_kind_ends_soon_after_a_signal(
    monkeypatch: pytest.MonkeyPatch, jobs: int, count: int, symbols: int, how: Any
) -> None:
    asked: list[int] = []
    monkeypatch.setattr(workers, "came", lambda: len(asked))
    ends_soon(lambda: asked.append(0), Stopped, jobs, count, symbols, how)


@pytest.mark.slow
def test_in_a_script_ctrl_c_is_python_s_and_ends_the_threads_as_well() -> None:
    # Tests may be started in the background, where Ctrl-C is ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        press = lambda: os.kill(os.getpid(), signal.SIGINT)  # noqa: E731
        ends_soon(press, KeyboardInterrupt, *IN_THREADS)
    finally:
        signal.signal(signal.SIGINT, before)
