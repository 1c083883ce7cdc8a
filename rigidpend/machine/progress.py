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
from typing import Any, Self

PERIOD = 0.5
"""Seconds between changes of the line on a terminal."""
PATIENCE, LOG_PATIENCE = 3.0, 30.0
"""Seconds of silence before a line that changes, and before lines that stay."""
BETWEEN = 2.0
"""Seconds between lines on parts, where each line stays."""
RECENT = 4.0
"""Power of the share that was done by which a part weighs: the last fifth weighs 0.6 of all."""
BELIEF = 0.05
"""Share after which an experiment's own pace counts as much as what was expected of it."""


class PartDone(str):
    """A line of progress that also knows what share of an experiment is done."""

    share: float

    def __new__(cls, text: str, done: float, total: float) -> Self:
        self = super().__new__(cls, text)
        self.share = done / total
        return self

    def __getnewargs__(self) -> tuple[Any, ...]:
        return str(self), self.share, 1


@dataclass
class _Pace:
    """Pace of an experiment that is under way; late parts weigh more than early ones."""

    begun: float
    last: float
    """When its last part was done."""
    share: float = 0.0
    time: float = 0.0
    """Weighted seconds of the parts so far."""
    done: float = 0.0
    """Weighted shares of the same parts."""

    def hear(self, share: float, now: float) -> None:
        """Take up a part."""
        if share <= self.share:
            return
        fading = (self.share / share) ** RECENT
        self.time = fading * self.time + now - self.last
        self.done = fading * self.done + share - self.share
        self.last, self.share = now, share

    def rest(self, expected: float | None, now: float) -> float | None:
        """Estimate the seconds that are left; None where nothing tells."""
        own = self.time / self.done if self.done else expected
        if own is None:
            return None
        belief = self.share / (self.share + BELIEF)
        whole = belief * own + (1 - belief) * (own if expected is None else expected)
        left = (1 - self.share) * whole - (now - self.last)
        # What takes longer than was expected, and never said how far it is, may take any time.
        return None if left < 0 and not self.share else max(0.0, left)


class Course:
    """Progress of several experiments, with an estimate of the time left.

    A :class:`PartDone` says how far its experiment is. What an experiment is expected to take
    counts until its own parts tell more; the experiments that are over say how much slower or
    faster this machine is than expected.

    Parameters
    ----------
    total : int
        How many experiments there are.
    expected : mapping, optional
        Seconds that experiments take, by name, as far as they are known.
    at_once : int, optional
        How many are under way at a time.
    """

    def __init__(
        self, total: int, expected: Mapping[str, float] | None = None, at_once: int = 1
    ) -> None:
        self.total, self.done, self.last = total, 0, ("", "")
        self.begun: float | None = None
        self._expected, self._at_once = dict(expected or {}), max(1, at_once)
        self._running: dict[str, _Pace] = {}
        self._took: dict[str, float] = {}

    def hear(self, name: str, text: str, now: float) -> None:
        """Take a line of an experiment that is under way."""
        self.last = name, text
        self.begun = now if self.begun is None else self.begun
        pace = self._running.setdefault(name, _Pace(now, now))
        if isinstance(text, PartDone):
            pace.hear(text.share, now)

    def end(self, now: float, name: str | None = None) -> None:
        """Note that an experiment is over, well or not: that name, or the one heard of last."""
        self.done += 1
        name = self.last[0] if name is None else name
        pace = self._running.pop(name, None)
        self._took[name] = now - pace.begun if pace else 0.0

    def left(self, now: float) -> float | None:
        """Estimate the seconds that the rest takes; None where nothing is known of it."""
        if self.begun is None:
            return None
        running = {name: self._rest(name, now) for name in self._running}
        known = {name: x for name, x in running.items() if x is not None}
        waiting = self._waiting(known, now)
        if waiting is None or len(known) < len(running):
            return None
        open_ = max(1, self.total - self.done)
        return (waiting + sum(known.values())) / min(self._at_once, open_)

    def said(self, now: float) -> str:
        """Count of finished experiments, the time since the start, and the time left if known."""
        left = self.left(now)
        gone = f", {duration(now - self.begun)}" if self.begun is not None else ""
        rest = "" if left is None else f", about {duration(left)} left"
        return f"{self.done} of {self.total} done{gone}{rest}"

    def status(self, now: float) -> str:
        """Text of the changing line."""
        return f"[{self.said(now)}] {': '.join(self.last)}"

    def _expectation(self, name: str) -> float | None:
        """Seconds that an experiment takes here, by what others took of what they were to take."""
        expected = self._expected.get(name)
        known = [each for each in self._took if each in self._expected]
        whole = sum(self._expected[each] for each in known)
        pace = sum(self._took[each] for each in known) / whole if whole > 0 else 1.0
        return None if expected is None else expected * pace

    def _rest(self, name: str, now: float) -> float | None:
        return self._running[name].rest(self._expectation(name), now)

    def _waiting(self, rests: Mapping[str, float], now: float) -> float | None:
        """Seconds of the experiments that have not begun, by the rests of those that have."""
        begun = self._running.keys() | self._took.keys()
        known = [self._expectation(name) or 0.0 for name in self._expected if name not in begun]
        unknown = self.total - self.done - len(self._running) - len(known)
        if unknown <= 0:
            return sum(known)
        taken = list(self._took.values())
        taken += [now - self._running[name].begun + rest for name, rest in rests.items()]
        return sum(known) + unknown * sum(taken) / len(taken) if taken else None


class Progress:
    """Display of a run's progress, used in a ``with`` statement.

    Parameters
    ----------
    course : Course
    stream : text file
        Stream of the messages: stderr.
    start : float
        When the command began, by the clock.
    quiet, verbose : bool
        Say nothing, or everything with its time.
    patience : float
        Seconds for which nothing is said of what may soon be over.
    clock : callable
        Seconds.
    """

    def __init__(
        self,
        course: Course,
        stream: Any,
        start: float,
        *,
        quiet: bool = False,
        verbose: bool = False,
        patience: float = 0.0,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.course, self._stream, self._clock = course, stream, clock
        self._quiet, self._verbose, self._patience = quiet, verbose, patience
        self._changing = not quiet and changes(stream)
        self._shown, self._start = "", start
        self._last: dict[str, str] = {}
        self._part = -math.inf
        self._lock, self._over = threading.Lock(), threading.Event()

    def __enter__(self) -> Self:
        if self._changing:
            threading.Thread(target=self._tick, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        with self._lock:
            self._show("")

    def hear(self, name: str, text: str) -> None:
        """Take a line of the runner on an experiment."""
        with self._lock:
            self.course.hear(name, text, self._clock())
            self._last[name] = text
            if not self._due(text):
                return
            if self._changing and not self._verbose:
                self._show(self.course.status(self._clock()))
            else:
                self._print(f"{name}: {text}")

    def clear(self) -> None:
        """Clear the changing line, for others write to the terminal."""
        with self._lock:
            self._show("")

    def end(self, well: bool, name: str | None = None) -> None:
        """Note that an experiment is over: on a terminal its last line stays, if it ended well.

        Parameters
        ----------
        well : bool
        name : str, optional
            Which; the one heard of last if not given.
        """
        with self._lock:
            name = self.course.last[0] if name is None else name
            self.course.end(self._clock(), name)
            if self._changing and not self._verbose:
                self._show("")
                if well:
                    self._print(f"{name}: {self._last.get(name, '')}")
            # A log needs no word on what ends at once, and a failure may be the end of all.
            elif well and (self.course.left(self._clock()) or 0.0) >= 1.0:
                self._print(self.course.said(self._clock()))

    def tell(self, line: str, *, detail: bool = False) -> None:
        """Write a line that stays; a detail only where everything is said."""
        if self._verbose or not detail:
            with self._lock:
                self._print(line)

    def _due(self, text: str) -> bool:
        """True if a line is to be shown: not too early, and parts not too often in a log."""
        now = self._clock()
        if now - self._start < self._patience:
            return False
        if not isinstance(text, PartDone) or self._changing:
            return True
        due = text.share == 1 or now - self._part >= BETWEEN
        self._part = now if due else self._part
        return due

    def _print(self, line: str) -> None:
        if self._quiet:
            return
        before, shown = f"{self._clock() - self._start:8.2f} s  ", self._shown
        self._show("")
        self._write(f"{before if self._verbose else ''}{line}\n")
        self._show(shown)

    def _show(self, text: str) -> None:
        """Change the changing line; the rest of a longer one is written over with blanks."""
        # A line as wide as the terminal would wrap, and the next one not write over it.
        width = shutil.get_terminal_size().columns - 1
        text = text[:width]
        if text != self._shown:
            blanks = " " * (len(self._shown) - len(text))
            self._write(f"\r{text}{blanks}" if text else f"\r{blanks}\r")
        self._shown = text

    def _write(self, text: str) -> None:
        """Write for people; where there is no room, their words are no reason not to compute."""
        try:
            self._stream.write(text)
            self._stream.flush()
        except BrokenPipeError:
            raise
        except OSError:
            self._quiet = True

    def _tick(self) -> None:
        """Refresh the time left, between two lines too."""
        while not self._over.wait(PERIOD):
            with self._lock:
                if self.course.begun is not None and self._due("") and not self._over.is_set():
                    self._show(self.course.status(self._clock()))


def shown(total: int, expected: Mapping[str, float] | None = None) -> Progress:
    """Display on stderr for what may soon be over: where lines stay it waits longer than else."""
    stream = sys.stderr
    patience = PATIENCE if changes(stream) else LOG_PATIENCE
    course = Course(total, expected)
    return Progress(course, stream, time.perf_counter(), patience=patience)


def changes(stream: Any) -> bool:
    """True if a line of a stream can be changed: on a terminal, and in a notebook."""
    terminal = stream.isatty() and os.environ.get("TERM", "") != "dumb"
    return terminal or "ipykernel" in sys.modules


def duration(seconds: float) -> str:
    """Write a duration briefly: 8 s, 3 min, 2.5 h."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def tell_nobody(text: str) -> None:
    """Drop a line of progress."""
