"""Route codes of a body and initial phases, with a proof of every symbol.

The proof of an orbit is an approximation, in enough bits, that the checker accepts. The work of a
long one is estimated before it begins, and its progress reported. All times are dimensionless, t'.
"""

import math
import os
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from flint import arb
from numpy.typing import NDArray

from rigidpend.machine.progress import duration, tell_nobody
from rigidpend.machine.workers import check_stop, side_by_side
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.free_body import symbols
from rigidpend.numbers import Scalar, checked
from rigidpend.numbers.exact import Exact
from rigidpend.numbers.texts import NO_SYMBOL, words
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.routes.certified.approximation import Approximation
from rigidpend.routes.certified.balls import alone
from rigidpend.routes.certified.orbit import AT_START, OrbitChecker, Proof, enclosed, proof_of
from rigidpend.routes.certified.proof_data import ORBIT_BITS, ORBIT_STEPS, Step, Undecided
from rigidpend.routes.codes import codes_of, shown
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem, passage_limit

ATTEMPTS, BITS_GROWTH = 3, 1.3
"""Trials of a proof whose bits do not suffice, and the factor by which bits grow."""
FEWEST_BITS = 8
"""Bits at the start at least."""
MOST_WORK = 2**31
"""Largest work on an orbit, the sum of bits^2 over its steps: an hour or two."""
OF_WORK = 2.5e-6
"""Seconds of a bit^2 of work: 1.5e-6 to 3.6e-6 from 100 to 3000 bits, as measured."""
LONG_WORK = 2**24
"""Work that a line announces before it begins: half a minute or more."""
LINE_SECONDS = 5.0
"""Seconds from one line to the next."""

THREADS = "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"
"""Variables that give libraries of linear algebra their number of threads."""

Report = Callable[[str], None]


class CertifiedCodes(NamedTuple):
    """The proven routes of n orbits; t' is the dimensionless time."""

    theta2_0: NDArray[np.float64]
    """(n,), radians, rounded; the proofs are of the exact phases, not of these doubles."""
    codes: NDArray[np.uint8]
    """(n_symbols, n), row 0 = symbol 1: 0 left, 1 right, 255 not proven."""
    proven: NDArray[np.bool_]
    """(n_symbols, n)."""
    crossing_time: NDArray[np.float64]
    """(n_symbols + 1, n), t' of the crossings of J1 = J2/2; NaN where none is proven."""
    time_radius: NDArray[np.float64]
    """(n_symbols + 1, n), t'; the exact time is within this of `crossing_time`."""
    bound: NDArray[np.float64]
    """(n_symbols + 1, n), bound on the computed orbit's distance from the exact one; else NaN."""
    separatrix: NDArray[np.uint8]
    """(n_symbols + 1, n), 1..4; 0 where no crossing is proven."""
    bits: NDArray[np.uint16]
    """(n,), bits of the orbit's first step, 0 without steps."""
    reason: list[str]
    """The reason for which an orbit is undecided; empty where all its symbols are proven."""
    steps: list[list[Step]]
    """The polynomials of each orbit, which are its proof."""

    @property
    def status(self) -> list[str]:
        """`proven` or `undecided`, for each orbit."""
        return ["undecided" if reason else "proven" for reason in self.reason]

    @property
    def words(self) -> list[str]:
        """Codes as texts, one an orbit: 0, 1, ``?`` for a symbol that is not proven."""
        return words(self.codes, self.proven)

    def __repr__(self) -> str:
        return shown("proven routes", self.theta2_0, self.words)


def certify_codes(
    body: Body,
    theta2_0: Any,
    *,
    h0: Scalar,
    J1_0: Scalar,
    n_symbols: int = 15,
    bits: int | None = None,
    jobs: int = 1,
    report: Report = tell_nobody,
) -> CertifiedCodes:
    """Prove the binary route codes of orbits on S1-, as in Fig. 4.

    The orbits are those of `rigidpend.route_codes`, taken exactly: decimals and fractions as
    rational numbers, roots, pi and angles as enclosures.

    Parameters
    ----------
    body : Body
    theta2_0 : number or sequence of numbers
        Initial phases in radians; a float is the double that it is.
    h0 : number
        Energy constant, greater than mu.
    J1_0 : number
        Initial action, dimensionless, 0 < J1_0 < J2_0, not J2_0/2.
    n_symbols : int, optional
        How many symbols to prove on each orbit.
    bits : int, optional
        Bits at the start, where the bound on the distance is 2^-bits; by default as many as an
        integration in doubles tells, and more where these do not suffice.
    jobs : int, optional
        How many processes. No result depends on it.
    report : callable, optional
        Takes lines on proofs that take long.

    Returns
    -------
    CertifiedCodes

    Raises
    ------
    ParameterError, ExactError
        A value that is excluded or that is no number; the message says which.
    """
    jobs = checked.whole("jobs", jobs, 1)
    if bits is not None:
        bits = checked.whole("bits", bits, FEWEST_BITS, ORBIT_BITS)
    return proven_codes(RouteProblem(body, h0, J1_0, n_symbols), theta2_0, bits, jobs, report)


@alone
def proven_codes(
    problem: RouteProblem, theta2_0: Any, bits: int | None, jobs: int, report: Report
) -> CertifiedCodes:
    """Prove the route codes of the orbits of a checked problem: see :func:`certify_codes`."""
    phases = Phases(theta2_0)
    problem.afford(len(phases))
    exactly = phases.exactly(range(len(phases)))
    orbits = list(zip(exactly, *_expected(problem, exactly), strict=True))
    return _record(problem, phases.high, _proofs(_orbit, (problem, bits), orbits, jobs, report))


@alone
def checked_codes(
    problem: RouteProblem, phases: Sequence[Exact], steps: Sequence[Sequence[Step]], jobs: int
) -> CertifiedCodes:
    """Route codes that the steps of a certificate prove; they are checked without integration."""
    high = np.array([float(x) for x in phases])
    proofs = _proofs(_again, (problem,), list(zip(phases, steps, strict=True)), jobs)
    return _record(problem, high, proofs)


def _proofs(
    work: Callable[..., Proof],
    of: tuple[Any, ...],
    orbits: Sequence[Any],
    jobs: int,
    report: Report | None = None,
) -> list[Proof]:
    """Proofs of orbits, in their order, by processes of one thread each: matrices are small."""
    # A process reads these variables where it loads its linear algebra, so they are set before.
    before = dict(os.environ)
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        return side_by_side(work, of, True, orbits, jobs, report)
    finally:
        for name in THREADS:
            del os.environ[name]
        os.environ.update({name: before[name] for name in THREADS if name in before})


def _orbit(
    orbit: tuple[Exact, float, int], problem: RouteProblem, bits: int | None, report: Report
) -> Proof:
    """Prove one orbit, with more bits where the first do not suffice."""
    theta2_0, time, tries = orbit
    # A double is enough for the name: the exact phase of a grid is an expression start + step k.
    name = f"theta2_0 = {float(theta2_0)!r}"
    try:
        steps, enough = asked_for(problem, time, theta2_0)
    except Undecided as doubt:
        return Proof([], [], str(doubt))
    asked, tries = (enough, tries) if bits is None else (bits, 1)
    found, spent = Proof([], [], ""), 0
    for _ in range(tries):
        asked = min(asked, ORBIT_BITS)
        progress = ProofProgress(name, steps, asked, report, spent)
        # Given bits are not refused beforehand: `ProofProgress.step` stops what takes too long.
        if bits is None and (reason := progress.refusal()):
            return found if found.reason else Proof([], [], reason)
        found = prove(problem, theta2_0, asked, progress)
        # All trials of an orbit share MOST_WORK.
        spent += progress.work
        if not found.unshown or asked == ORBIT_BITS:
            break
        asked = math.ceil(asked * BITS_GROWTH)
    return found


def _again(orbit: tuple[Exact, Sequence[Step]], problem: RouteProblem) -> Proof:
    return proof_of(problem, *orbit)


def _expected(problem: RouteProblem, theta2_0: Sequence[Exact]) -> tuple[list[float], list[int]]:
    """Times t' of the last crossings as doubles find them, and the number of trials of each orbit.

    Without a last crossing the time is that up to which one is waited for, and a single trial
    tells as much as several.
    """
    # Doubles suffice for an estimate: where it is too short, another trial takes more bits.
    routes = codes_of(problem, theta2_0, resolve(precisions=(53,)), method="integration")
    limit, last = passage_limit(problem, 53), routes.crossing_time[-1]
    reached = np.nan_to_num(routes.crossing_time).max(axis=0)
    found = np.isfinite(last)
    times, tries = np.where(found, last, reached + limit), np.where(found, ATTEMPTS, 1)
    return times.tolist(), tries.tolist()


def _record(
    problem: RouteProblem, theta2_0: NDArray[np.float64], proofs: Sequence[Proof]
) -> CertifiedCodes:
    shape = (problem.n_symbols + 1, len(proofs))
    time, radius, bound = (np.full(shape, np.nan) for _ in range(3))
    separatrix = np.zeros(shape, dtype=np.uint8)
    for column, proof in enumerate(proofs):
        for row, crossing in enumerate(proof.crossings):
            time[row, column], radius[row, column] = crossing.time, crossing.radius
            separatrix[row, column], bound[row, column] = crossing.separatrix, crossing.bound
    codes = symbols(separatrix)
    bits = np.array([proof.bits for proof in proofs], dtype=np.uint16)
    # In the order of the fields of `CertifiedCodes`, up to `bits`.
    of = theta2_0, codes, codes != NO_SYMBOL, time, radius, bound, separatrix, bits
    return CertifiedCodes(*of, [proof.reason for proof in proofs], [x.steps for x in proofs])


class ProofProgress:
    """Lines on the progress of one orbit's proof, and the bound on its work.

    About `steps` steps are expected, with `bits` at the first that fall to nearly none at the
    last. `spent` is the work of the trials before this one.
    """

    def __init__(self, name: str, steps: int, bits: int, report: Report, spent: int = 0) -> None:
        self.name, self.steps, self.bits, self._report = name, steps, bits, report
        # The mean of the square of a number that falls linearly from `bits` to 0.
        self.expected = steps * bits * bits // 3
        self.work, self._taken, self._spent = 0, 0, spent
        self._begun = self._said = time.monotonic()
        if LONG_WORK < self.expected <= MOST_WORK:
            long = duration(self.expected * OF_WORK)
            report(f"{name}: about {steps} steps of up to {bits} bits, which may take {long}")

    def refusal(self) -> str:
        """The reason for which a proof is not begun; empty where its work is within the bound."""
        if self.expected <= MOST_WORK:
            return ""
        times = f"{self.expected / MOST_WORK:.1f} times the work that an orbit may take"
        return f"it asks for about {self.steps} steps of up to {self.bits} bits, {times}"

    def step(self, bits: int) -> bool:
        """Count a step of so many bits; False if no further one may be taken."""
        self.work, self._taken = self.work + bits * bits, self._taken + 1
        now = time.monotonic()
        if now - self._said > LINE_SECONDS:
            self._said = now
            left = max(0, self.expected - self.work) / self.work * (now - self._begun)
            told = f"step {self._taken} of about {self.steps}, {bits} bits left"
            self._report(f"{self.name}: {told}, about {left:.0f} s to go")
        return self._spent + self.work < MOST_WORK


MARGIN_BITS = 26
"""Bits of a step beyond those of its bound: the defect is as many bits above a unit."""


def prove(
    problem: RouteProblem, theta2_0: Exact, bits: int, progress: ProofProgress | None = None
) -> Proof:
    """Find steps that prove all crossings, beginning with a bound of about 2^-bits.

    The bits of steps fall as the bound grows. `theta2_0` is in radians.
    """
    start = enclosed(problem, theta2_0, bits + MARGIN_BITS + AT_START)
    orbit, checker = Approximation(start.numbers.field, start.state), OrbitChecker(start)
    unit, steps, reason, unshown = float(start.unit), [], "", False
    work, last, limit = bits + MARGIN_BITS, 0.0, passage_limit(problem, 53)
    while len(checker.crossings) <= problem.n_symbols:
        check_stop()
        step = orbit.step(work)
        try:
            checker.take(step)
        except Undecided as doubt:
            reason, unshown = str(doubt), True
            break
        steps.append(step)
        if checker.crossings:
            last = checker.crossings[-1].time
        # On an invariant plane no crossing follows, which no finite piece of an orbit can show.
        if float(checker.time) / unit - last > limit or len(steps) == ORBIT_STEPS:
            reason = f"no crossing within t' = {limit:.4g}"
            break
        if progress and not progress.step(step.bits):
            reason = f"an orbit may take no more work than these {len(steps)} steps"
            break
        # The bound only grows, and coefficients much finer than it say nothing.
        work = min(work, MARGIN_BITS + _digits(checker.bound))
    return Proof(checker.crossings[: problem.n_symbols + 1], steps, reason, unshown)


LEFT = 14
"""Bits that are to be left at the end of an orbit."""
MEAN = 0.9
"""Mean rate of growth over the rate at |M3| = |M|; measured on Fig. 4.

At crossings, where M3 passes zero, the rate is smaller."""


def asked_for(problem: RouteProblem, time: float, theta2_0: Exact) -> tuple[int, int]:
    """Estimate how many steps of full length a proof up to a time t' takes, and how many bits."""
    start = enclosed(problem, theta2_0, AT_START)
    length = time * float(start.unit)
    longest = Approximation(start.numbers.field, start.state).longest
    size = float(start.state[2].abs_upper())
    # The rate at |M3| = |M|, as beside the periodic orbits, where an orbit spends most of its time.
    rate = float(start.numbers.growth.rate(arb(size), arb(0)))
    bits = math.ceil(MEAN * rate * length / math.log(2)) + LEFT
    return min(ORBIT_STEPS, math.ceil(length / longest)), bits


def _digits(bound: arb) -> int:
    """The largest k >= 0 with bound < 2^-k, or 0: bits that the bound leaves to be known."""
    mantissa, exponent = bound.upper().man_exp()
    return max(0, -(int(exponent) + int(mantissa).bit_length()))
