"""Progress display on stderr: one changing line on a terminal, plain lines elsewhere."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Mapping
from time import time
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self

if TYPE_CHECKING:
    from tqdm import tqdm

PERIOD, LOG_PERIOD = 0.5, 2.0
"""Seconds before and between changes of a line on a terminal, and lines on parts in a log."""
PATIENCE, LOG_PATIENCE = 3.0, 30.0
"""Seconds before the first line on work that may soon be finished, likewise."""
LINE = "[{percentage:.0f} %, {elapsed}, {remaining} left] {desc}"
"""Format of the line for tqdm."""


class PartDone(str):
    """A line of progress with the finished share of an experiment."""

    share: float

    # The default is for a copy from another process, which gets its share afterwards.
    def __new__(cls, text: str, done: float = 0.0, total: float = 1.0) -> Self:
        self = super().__new__(cls, text)
        self.share = done / total
        return self


class Progress:
    """Display of the progress of several experiments, used in a ``with`` statement.

    tqdm estimates the time left from the shares that each :class:`PartDone` reports, weighted by
    the expected seconds of the experiments, by name; without them an experiment counts as one.
    `at_once` experiments share the machine; 0 if that is not known, and no whole time is told. It
    is told until the first share is known, from which the time left is learned.

    A patient display shows nothing at first, since the work may soon be finished; a quiet one shows
    nothing at all, and a verbose one every line with its time.
    """

    def __init__(
        self,
        total: int,
        expected: Mapping[str, float] = MappingProxyType({}),
        at_once: int = 1,
        *,
        patient: bool = False,
        quiet: bool = False,
        verbose: bool = False,
    ) -> None:
        self._total, self._expected, self._at_once = total, expected, at_once
        self._quiet, self._verbose = quiet, verbose
        self._changing = not quiet and not verbose and changes()
        self._patience = (PATIENCE if self._changing else LOG_PATIENCE) if patient else 0.0
        self._period = PERIOD if self._changing else LOG_PERIOD
        self._start = self._moved = time()
        self._ended, self._done, self._said = 0, 0.0, ""
        self._whole = sum(expected.values()) + total - len(expected)
        self._lines, self._shares = dict[str, str](), dict[str, float]()
        self._bar: tqdm[Any] | None = None
        self._lock, self._over = threading.RLock(), threading.Event()

    def __enter__(self) -> Self:
        if self._changing:
            threading.Thread(target=self._tick, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        with self._lock:
            self.clear()
            if self._bar:
                self._bar.close()

    def hear(self, name: str, text: str) -> None:
        """Take a line of the runner on an experiment."""
        with self._lock:
            self._lines[name], self._said = text, f"; {name}: {text}"
            permanent = self._verbose or not (self._changing or isinstance(text, PartDone))
            if permanent and time() >= self._start + self._patience:
                self._print(f"{name}: {text}")
            self._advance(name, getattr(text, "share", 0.0))

    def end(self, name: str, *, well: bool) -> None:
        """Note the end of an experiment: on a terminal its last line stays, if it ended well."""
        with self._lock:
            if self._changing and well:
                self._print(f"{name}: {self._lines[name]}")
            self._ended, self._said = self._ended + 1, ""
            self._advance(name, 1.0)

    def tell(self, line: str, *, detail: bool = False) -> None:
        """Write a permanent line; a detail only if the display is verbose."""
        if self._verbose or not detail:
            with self._lock:
                self._print(line)

    def clear(self) -> None:
        """Clear the changing line, because something else writes to the terminal."""
        with self._lock:
            if self._bar:
                self._bar.clear()

    def _advance(self, name: str, share: float) -> None:
        """Note a share, which never falls; in a log the line on it is written if one is due."""
        bar, more = self._due_bar(), share - self._shares.get(name, 0.0)
        if more > 0:
            self._shares[name], self._moved = share, time()
            self._done += more * self._expected.get(name, 1.0)
            # From here on the time left is learned, to which the whole that was told need not fit.
            if bar:
                bar.bar_format = LINE
            # The shares may add up to a rounding more than the whole, and -00:00 would be left.
            due = bar and bar.update(min(self._done, self._whole) - bar.n)
            # Behind the last line of all there is nothing to wait for.
            if due and not self._changing and self._ended < self._total:
                self._print(str(bar))

    def _due_bar(self) -> tqdm[Any] | None:
        """The bar of tqdm, which is imported when one is due: short work does not wait for it."""
        late = time() >= self._start + max(self._period, self._patience)
        if late and self._bar is None and not self._quiet and not self._verbose:
            from tqdm import tqdm

            known = self._expected and self._at_once
            of = f" of about {duration(self._whole / self._at_once)}" if known else ""
            self._bar = tqdm(
                total=self._whole,
                # An earlier run may have done it, which tells nothing of the pace.
                initial=self._done,
                bar_format=LINE.replace("%", f"%{of}"),
                mininterval=self._period,
                miniters=0,
                # Not before it has its text.
                delay=self._period,
                leave=False,
                dynamic_ncols=self._changing,
                # Only a line that is to be replaced must not wrap.
                ncols=None if self._changing else 1000,
                # Below the screen nothing is shown: in a log tqdm only says when a line is due.
                position=None if self._changing else 1000,
            )
            self._bar.start_t, self._bar.last_print_t = self._start, self._moved
        if self._bar:
            said = f"{self._ended} of {self._total} done{self._said}"
            self._bar.set_description_str(said, refresh=False)
        return self._bar

    def _print(self, line: str) -> None:
        """Write a line to stderr; on a full disk it is lost, and the computation goes on."""
        if not self._quiet:
            self.clear()
            before = f"{time() - self._start:8.2f} s  " if self._verbose else ""
            try:
                print(f"{before}{line}", file=sys.stderr, flush=True)
            except BrokenPipeError:
                raise
            except OSError:
                self._quiet = True

    def _tick(self) -> None:
        """Refresh the line, also between two parts."""
        while not self._over.wait(self._period):
            with self._lock:
                if self._lines and not self._over.is_set() and (bar := self._due_bar()):
                    bar.refresh()


def changes() -> bool:
    """True if the last line on stderr can be replaced: on a terminal and in a notebook."""
    terminal = sys.stderr.isatty() and os.environ.get("TERM", "") != "dumb"
    return terminal or "ipykernel" in sys.modules


def duration(seconds: float) -> str:
    """Write a duration briefly: 8 s, 3 min, 2.5 h."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def tell_nobody(text: str) -> None:
    """Drop a line of progress."""
