"""Progress display on stderr: one changing line on a terminal, plain lines elsewhere.

Neither colours nor other control sequences are written, only carriage returns on a terminal.
"""

from __future__ import annotations

import os
import shutil
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, Self

PERIOD = 0.5
"""Seconds between changes of the line on a terminal."""


class PartDone(str):
    """A line of progress that also knows what share of an experiment is done."""

    share: float

    def __new__(cls, text: str, done: int, total: int) -> Self:
        self = super().__new__(cls, text)
        self.share = done / total
        return self


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
        self._running: dict[str, tuple[float, float]] = {}
        self._took: dict[str, float] = {}

    def hear(self, name: str, text: str, now: float) -> None:
        """Take a line of an experiment that is under way."""
        self.last = name, text
        self.begun = now if self.begun is None else self.begun
        begun, share = self._running.setdefault(name, (now, 0.0))
        if isinstance(text, PartDone):
            share = max(share, text.share)
        self._running[name] = begun, share

    def end(self, now: float, name: str | None = None) -> None:
        """Note that an experiment is over, well or not: that name, or the one heard of last."""
        self.done += 1
        name = self.last[0] if name is None else name
        begun, _ = self._running.pop(name, (now, 0.0))
        self._took[name] = now - begun

    def left(self, now: float) -> float | None:
        """Estimate the seconds that the rest takes; None where nothing is known of it."""
        if self.begun is None:
            return None
        waiting = self._waiting(now)
        running = [self._rest(name, now) for name in self._running]
        if waiting is None or None in running:
            return None
        return (waiting + sum(filter(None, running))) / min(self._at_once, max(1, self._open()))

    def said(self, now: float) -> str:
        """Count of finished experiments, the time since the start, and the time left if known."""
        left = self.left(now)
        gone = f", {duration(now - self.begun)}" if self.begun is not None else ""
        rest = "" if left is None else f", about {duration(left)} left"
        return f"{self.done} of {self.total} done{gone}{rest}"

    def status(self, now: float) -> str:
        """Text of the changing line."""
        return f"[{self.said(now)}] {': '.join(self.last)}"

    def _open(self) -> int:
        return self.total - self.done

    def _pace(self) -> float:
        """Seconds that an expected second takes here."""
        known = [name for name in self._took if name in self._expected]
        expected = sum(self._expected[name] for name in known)
        return sum(self._took[name] for name in known) / expected if expected > 0 else 1.0

    def _waiting(self, now: float) -> float | None:
        """Seconds of the experiments that have not begun."""
        count = self._open() - len(self._running)
        begun = self._running.keys() | self._took.keys()
        known = [x * self._pace() for name, x in self._expected.items() if name not in begun]
        unknown = count - len(known)
        if unknown <= 0:
            return sum(known)
        taken = list(self._took.values())
        taken += filter(None, (self._whole(name, now) for name in self._running))
        return sum(known) + unknown * sum(taken) / len(taken) if taken else None

    def _whole(self, name: str, now: float) -> float | None:
        """Seconds that a running experiment takes in all; None if nothing is known of it."""
        begun, share = self._running[name]
        expected = self._expected.get(name)
        own = (now - begun) / share if share else None
        if expected is None:
            return own
        # The further it is the more its own pace counts.
        expected *= self._pace()
        return expected if own is None else share * own + (1 - share) * expected

    def _rest(self, name: str, now: float) -> float | None:
        whole = self._whole(name, now)
        return None if whole is None else max(0.0, whole - (now - self._running[name][0]))


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
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.course, self._stream, self._clock = course, stream, clock
        self._quiet, self._verbose = quiet, verbose
        self._changing = not quiet and is_terminal(stream)
        self._shown, self._start = "", start
        self._last: dict[str, str] = {}
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
                if self.course.begun is not None and not self._over.is_set():
                    self._show(self.course.status(self._clock()))


def is_terminal(stream: Any) -> bool:
    """True if a stream is a terminal, on which a line can be changed."""
    return stream.isatty() and os.environ.get("TERM", "") != "dumb"


def duration(seconds: float) -> str:
    """Write a duration briefly: 8 s, 3 min, 2.5 h."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def tell_nobody(text: str) -> None:
    """Drop a line of progress."""
