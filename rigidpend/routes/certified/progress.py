"""Progress of a long proof: what it will take, beforehand, and lines now and then."""

from __future__ import annotations

import time
from collections.abc import Callable

MOST_WORK = 2**31
"""Work on an orbit at most, the sum of bits^2 over its steps: an hour or two.

A step takes 1.5 to 3.6 microseconds times bits^2, from 100 to 3000 bits, as measured."""
LONG = 2**24
"""Work of which a line tells before it begins: half a minute or more."""
BETWEEN = 5.0
"""Seconds from one line to the next."""

Report = Callable[[str], None]


class ProofProgress:
    """Lines on the proof of one orbit.

    Parameters
    ----------
    name : str
        What the orbit is called.
    steps : int
        Steps that are expected.
    bits : int
        Bits of the first one; they fall to nearly none.
    report : callable
        Takes a line.
    spent : int, optional
        Work of trials before this one.
    """

    def __init__(self, name: str, steps: int, bits: int, report: Report, spent: int = 0) -> None:
        self.name, self.steps, self.bits, self._report = name, steps, bits, report
        self.expected = steps * bits * bits // 3
        self.work, self._taken, self._spent = 0, 0, spent
        self._begun = self._said = time.monotonic()
        if LONG < self.expected <= MOST_WORK:
            report(f"{name}: about {steps} steps of up to {bits} bits")

    def refusal(self) -> str:
        """Reason for which a proof is not begun; empty where it is worth it."""
        if self.expected <= MOST_WORK:
            return ""
        times = f"{self.expected / MOST_WORK:.1f} times the work that an orbit may take"
        return f"it asks for about {self.steps} steps of up to {self.bits} bits, {times}"

    def step(self, bits: int) -> bool:
        """Count a step of so many bits; False where no further one may be taken."""
        self.work, self._taken = self.work + bits * bits, self._taken + 1
        now = time.monotonic()
        if now - self._said > BETWEEN:
            self._said = now
            left = max(0, self.expected - self.work) / self.work * (now - self._begun)
            told = f"step {self._taken} of about {self.steps}, {bits} bits left"
            self._report(f"{self.name}: {told}, about {left:.0f} s to go")
        return self._spent + self.work < MOST_WORK
