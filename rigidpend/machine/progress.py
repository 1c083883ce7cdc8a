"""Progress display on stderr: one changing line on a terminal, plain lines elsewhere.

Neither colours nor other control sequences are written, only carriage returns on a terminal.
"""

from __future__ import annotations

import math
import os
import shutil
import sys
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Self

PERIOD = 0.5
"""Seconds between changes of the line on a terminal."""
PATIENCE, LOG_PATIENCE = 3.0, 30.0
"""Seconds of silence before a changing line is shown, and before permanent lines are."""
BETWEEN = 2.0
"""Least seconds before a permanent line on a part, after the previous line."""
RECENT = 4.0
"""Power of the finished share by which a part is weighted: the last fifth has a weight of 0.6."""
BELIEF = 0.05
"""Share of an experiment after which its own pace counts as much as its expected time."""


class PartDone(str):
    """A line of progress with the finished share of an experiment."""

    share: float

    def __new__(cls, text: str, done: float, total: float) -> Self:
        self = super().__new__(cls, text)
        self.share = done / total
        return self

    def __getnewargs__(self) -> tuple[Any, ...]:
        return str(self), self.share, 1


@dataclass
class _Course:
    """Course of an experiment: its pace, in which late parts weigh more than early ones."""

    begun: float
    last: float
    """Time at which its last part was finished."""
    line: str = ""
    """Last line about it."""
    took: float | None = None
    """Seconds that it took, after its end."""
    share: float = 0.0
    time: float = 0.0
    """Weighted seconds of the parts so far."""
    done: float = 0.0
    """Weighted shares of the same parts."""

    def hear(self, text: str, now: float) -> None:
        """Take a line, which may report a part."""
        self.line, share = text, getattr(text, "share", 0.0)
        if share > self.share:
            # A part weighs as share^RECENT at its end; relative to the new part earlier ones fade.
            fading = (self.share / share) ** RECENT
            self.time = fading * self.time + now - self.last
            self.done = fading * self.done + share - self.share
            self.last, self.share = now, share

    def rest(self, expected: float | None, now: float) -> float | None:
        """Estimate of the seconds left; None if nothing is known."""
        own = self.time / self.done if self.done else expected
        if own is None:
            return None
        # The more is done, the more its own pace counts against the expectation.
        belief = self.share / (self.share + BELIEF)
        whole = belief * own + (1 - belief) * (own if expected is None else expected)
        left = (1 - self.share) * whole - (now - self.last)
        # If it takes longer than expected and never reported a share, nothing is known.
        return None if left < 0 and not self.share else max(0.0, left)


class Progress:
    """Display of the progress of several experiments, used in a ``with`` statement.

    It estimates the time left. A :class:`PartDone` reports the share of its experiment. The
    expected time of an experiment, in seconds by name, counts until its own parts tell more; the
    finished experiments tell how much slower or faster this machine is than expected.

    `start` is the clock's time at which the command began. For the first `patience` seconds nothing
    is shown, since the work may soon be finished. A quiet display shows nothing, a verbose one
    every line with its time.
    """

    def __init__(
        self,
        total: int,
        expected: Mapping[str, float] = MappingProxyType({}),
        at_once: int = 1,
        *,
        stream: Any = None,
        start: float | None = None,
        quiet: bool = False,
        verbose: bool = False,
        patience: float = 0.0,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._total, self._expected, self._at_once = total, expected, max(1, at_once)
        self._stream, self._clock = sys.stderr if stream is None else stream, clock
        self._quiet, self._verbose, self._patience = quiet, verbose, patience
        self._changing = not quiet and changes(self._stream)
        self._start = clock() if start is None else start
        self._courses: dict[str, _Course] = {}
        self._shown, self._latest, self._said = "", "", -math.inf
        self._lock, self._over = threading.Lock(), threading.Event()

    def __enter__(self) -> Self:
        if self._changing:
            threading.Thread(target=self._tick, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self.clear()

    def hear(self, name: str, text: str) -> None:
        """Take a line of the runner on an experiment."""
        with self._lock:
            now = self._clock()
            self._latest = name
            self._courses.setdefault(name, _Course(now, now)).hear(text, now)
            if self._due(text):
                if self._changing and not self._verbose:
                    self._status()
                else:
                    self._print(f"{name}: {text}")

    def clear(self) -> None:
        """Clear the changing line, because something else writes to the terminal."""
        with self._lock:
            self._show("")

    def end(self, name: str, *, well: bool) -> None:
        """Note the end of an experiment: on a terminal its last line stays, if it ended well."""
        with self._lock:
            now = self._clock()
            course = self._courses.setdefault(name, _Course(now, now))
            course.took = now - course.begun
            if self._changing and not self._verbose:
                self._show("")
                if well:
                    self._print(f"{name}: {course.line}")
            # A log needs no count when little is left, nor after a failure, which may end all.
            elif well and (self.left() or 0.0) >= 1.0:
                self._print(self.said())

    def left(self) -> float | None:
        """Estimate of the seconds that the rest takes; None if nothing is known."""
        now, courses = self._clock(), self._courses
        over = {name: x.took for name, x in courses.items() if x.took is not None}
        known = [name for name in over if name in self._expected]
        whole = sum(self._expected[name] for name in known)
        # What was finished so far shows how slow this machine is beside the expectations.
        slowness = sum(over[name] for name in known) / whole if whole > 0 else 1.0
        expected = {name: slowness * x for name, x in self._expected.items()}
        running = {name: x for name, x in courses.items() if x.took is None}
        rests = [x.rest(expected.get(name), now) for name, x in running.items()]
        sure = [rest for rest in rests if rest is not None]
        if not courses or len(sure) < len(rests):
            return None
        taken = [now - x.begun + rest for x, rest in zip(running.values(), sure, strict=True)]
        taken += over.values()
        waiting = [x for name, x in expected.items() if name not in courses]
        # Experiments without any estimate are assumed to be like those that have begun.
        others = max(0, self._total - len(courses) - len(waiting))
        left = sum(sure) + sum(waiting) + others * sum(taken) / len(taken)
        return left / min(self._at_once, max(1, self._total - len(over)))

    def said(self) -> str:
        """Count of finished experiments, the time since the start, and the time left if known."""
        begun = min((x.begun for x in self._courses.values()), default=None)
        done = sum(x.took is not None for x in self._courses.values())
        gone = "" if begun is None else f", {duration(self._clock() - begun)}"
        rest = "" if (left := self.left()) is None else f", about {duration(left)} left"
        return f"{done} of {self._total} done{gone}{rest}"

    def tell(self, line: str, *, detail: bool = False) -> None:
        """Write a permanent line; a detail only if the display is verbose."""
        if self._verbose or not detail:
            with self._lock:
                self._print(line)

    def _due(self, text: str) -> bool:
        """True if a line is due: not too early, and in a log lines on parts not too often."""
        now = self._clock()
        if now - self._start < self._patience:
            return False
        early = now - self._said < BETWEEN and not self._changing
        if isinstance(text, PartDone) and text.share < 1 and early:
            return False
        self._said = now
        return True

    def _print(self, line: str) -> None:
        if not self._quiet:
            before, shown = f"{self._clock() - self._start:8.2f} s  ", self._shown
            self._show("")
            self._write(f"{before if self._verbose else ''}{line}\n")
            self._show(shown)

    def _status(self) -> None:
        self._show(f"[{self.said()}] {self._latest}: {self._courses[self._latest].line}")

    def _show(self, text: str) -> None:
        """Replace the changing line; blanks cover the rest of a longer one."""
        # A line as wide as the terminal would wrap, and the next one would not cover it.
        text = text[: shutil.get_terminal_size().columns - 1]
        if text != self._shown:
            blanks = " " * (len(self._shown) - len(text))
            self._write(f"\r{text}{blanks}" if text else f"\r{blanks}\r")
        self._shown = text

    def _write(self, text: str) -> None:
        """Write to stderr; on a full disk the message is lost, and the computation goes on."""
        try:
            self._stream.write(text)
            self._stream.flush()
        except BrokenPipeError:
            raise
        except OSError:
            self._quiet = True

    def _tick(self) -> None:
        """Refresh the time left periodically, also between two lines."""
        while not self._over.wait(PERIOD):
            with self._lock:
                if self._courses and self._due("") and not self._over.is_set():
                    self._status()


def shown(total: int, expected: Mapping[str, float] = MappingProxyType({})) -> Progress:
    """Display on stderr for work that may soon be finished: permanent lines wait longer."""
    return Progress(total, expected, patience=PATIENCE if changes(sys.stderr) else LOG_PATIENCE)


def changes(stream: Any) -> bool:
    """True if a stream can replace its last line: on a terminal and in a notebook."""
    terminal = stream.isatty() and os.environ.get("TERM", "") != "dumb"
    return terminal or "ipykernel" in sys.modules


def duration(seconds: float) -> str:
    """Write a duration briefly: 8 s, 3 min, 2.5 h."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def tell_nobody(text: str) -> None:
    """Drop a line of progress."""
