"""A proof of one orbit: an approximation that the checker accepts, with bits enough for it.

It tells beforehand what a long proof will take, and how far it is now and then.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

from flint import arb

from rigidpend.machine.workers import check_stop
from rigidpend.numbers.exact import Exact
from rigidpend.routes.certified.approximation import Approximation
from rigidpend.routes.certified.balls import enclosed
from rigidpend.routes.certified.checker import OrbitChecker, Outgrown, ProvenCrossing, Undecided
from rigidpend.routes.certified.pieces import ORBIT_STEPS, Step
from rigidpend.routes.problem import RouteProblem

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

    So many steps are expected, of `bits` that fall to nearly none; trials before this one have
    `spent` some work.
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


MARGIN = 26
"""Bits of a step beyond its bound: a defect is that much larger than a unit."""
AT_START = 64
"""Bits beyond those of the first step in which the exact problem is enclosed."""


class Proof(NamedTuple):
    """Proof of an orbit as far as it goes."""

    crossings: list[ProvenCrossing]
    steps: list[Step]
    reason: str
    """Reason for which it ends early; empty where it is whole."""
    outgrown: bool = False
    """True if it ends because its bound has grown too large for its bits."""

    @property
    def bits(self) -> int:
        """Bits of the first step."""
        return self.steps[0].bits if self.steps else 0


def prove(
    problem: RouteProblem,
    theta2_0: Exact,
    bits: int,
    n_crossings: int,
    limit: float,
    progress: ProofProgress | None = None,
) -> Proof:
    """Find steps that prove so many crossings, from a bound of 2^-bits at the start.

    Bits are lowered as the bound grows. `limit` is the longest wait for the next crossing, t'.
    """
    start = enclosed(problem, theta2_0, bits + MARGIN + AT_START)
    orbit, checker = Approximation(start.coefficients, start.state), OrbitChecker(start)
    unit, steps, reason, outgrown = float(start.unit), [], "", False
    work, last = bits + MARGIN, 0.0
    while len(checker.crossings) < n_crossings:
        check_stop()
        step = orbit.step(work)
        try:
            checker.take(step)
        except Undecided as doubt:
            reason, outgrown = str(doubt), isinstance(doubt, Outgrown)
            break
        steps.append(step)
        if checker.crossings:
            last = checker.crossings[-1].time
        # On an invariant plane no crossing follows, and no finite piece of an orbit can show that.
        if float(checker.time) / unit - last > limit or len(steps) == ORBIT_STEPS:
            reason = f"no crossing within t' = {limit:.4g}"
            break
        if progress and not progress.step(step.bits):
            reason = f"an orbit may take no more work than these {len(steps)} steps"
            break
        # The bound only grows, and coefficients much finer than it say nothing.
        work = min(work, MARGIN + _digits(checker.bound))
    return Proof(checker.crossings[:n_crossings], steps, reason, outgrown)


def check(problem: RouteProblem, theta2_0: Exact, steps: Sequence[Step], n_crossings: int) -> Proof:
    """Check given steps again: what they prove, without integration."""
    if not steps:
        return Proof([], [], "there are no steps")
    # In as many bits as `prove` took: what comes out is compared with the certificate bit by bit.
    start = enclosed(problem, theta2_0, steps[0].bits + AT_START)
    checker, reason = OrbitChecker(start), ""
    try:
        for step in steps:
            checker.take(step)
    except Undecided as doubt:
        reason = str(doubt)
    if not reason and len(checker.crossings) < n_crossings:
        reason = "the steps end before the last crossing"
    return Proof(checker.crossings[:n_crossings], list(steps), reason)


LEFT = 14
"""Bits that are to be left at the end."""
MEAN = 0.9
"""Mean rate of growth over that far from a crossing, where M3 passes zero; measured on Fig. 4."""


def asked_for(problem: RouteProblem, time: float, theta2_0: Exact) -> tuple[int, int]:
    """Steps that a proof up to a time t' takes, of full length, and bits, by its bound's growth."""
    start = enclosed(problem, theta2_0, AT_START)
    length = time * float(start.unit)
    longest = Approximation(start.coefficients, start.state).longest
    size = float(start.state[2].abs_upper())
    # The rate at |M3| = |M|, as beside the periodic orbits, where an orbit spends most of its time.
    rate = float(OrbitChecker(start).growth.rate(arb(size), arb(0)))
    bits = math.ceil(MEAN * rate * length / math.log(2)) + LEFT
    return min(ORBIT_STEPS, math.ceil(length / longest)), bits


def _digits(bound: arb) -> int:
    """Binary digits behind the point before a bound's first one."""
    mantissa, exponent = bound.upper().man_exp()
    return max(0, -(int(exponent) + int(mantissa).bit_length()))
