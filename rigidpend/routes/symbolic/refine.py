"""theta2_0 to any number of digits, by integration of the full equations.

Along an orbit a change of theta2_0 grows from crossing to crossing, by factors that the map's
derivatives tell. So a delay at a late crossing, against the time that the chain gives it, says by
how little theta2_0 is off. Corrected, the orbit follows the chain some crossings further, and so
on. In the end gamma3 = 0 at the last crossing is solved in the working precision.
"""

from __future__ import annotations

import itertools
import math
from decimal import Decimal, localcontext
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidpend.machine.workers import note
from rigidpend.mechanics.equations import aligned
from rigidpend.numbers.doubles import Array
from rigidpend.numbers.exact import context, exact, fraction
from rigidpend.orbits.integrate.reference_orbit import rung
from rigidpend.orbits.integrate.states import states_at
from rigidpend.routes.start import Scales, Start, start, states_exact
from rigidpend.routes.symbolic.chain import NoOrbit, tangents
from rigidpend.routes.symbolic.shortest import Path
from rigidpend.routes.symbolic.surface import STEP, Surface
from rigidpend.routes.symbolic.tables import Level

FAR = 1e-3
"""Delay, t', up to which it tells theta2_0: what it leaves is its square."""
FIRST_ERROR = 1e-11
"""Error of theta2_0 by the map in doubles, radians, and of its times in t', at most."""
ACROSS = 24
"""Bits by which what is rounded on the way stays below what has grown from the start: across the
layer of these orbits, some thousandth thick, a deviation grows as much more, once."""
SPARE = 15
"""Digits beyond those of theta2_0 that are known in which its orbit is followed."""
ROUNDS = 400
MARGIN = 3
"""Digits that theta2_0 has beyond those that tell a symbol."""
GUARD = 19
"""Bits beyond the digits: 12 were seen to be lost in 113 bits."""


class Solved(NamedTuple):
    """A path at its own energy."""

    path: Path
    level: Level
    by_energy: float
    """Derivative of theta2_0 in the energy, at a given end."""


class Growth(NamedTuple):
    """Growth of a change of theta2_0 along a chain, (n + 1,) at its crossings."""

    exponent: Array
    """log10 of the factor in time, t' per radian."""
    sign: Array
    chi: Array
    """Growth in chi over that in time, radians per t'."""


class Refined(NamedTuple):
    """A refined phase, and how far integration has confirmed its orbit."""

    theta2_0: Decimal
    """Radians, in [0, 2 pi)."""
    fixed: int
    """Symbols that its digits determine."""
    bits: int
    delay: float
    """Largest |t'| at the crossings in between, against the map."""
    crossing_time: Array


def growth(orbits: Surface, solved: Solved, h_factor: float) -> Growth:
    """Growth of a change of theta2_0 along a chain, its change of energy included."""
    chain, level = solved.path.chain, solved.level
    slopes = tangents(level, chain)
    theta = chain.unknown
    arrival = orbits.begin(level)(theta)
    at = arrival.crossing(level)
    early, late = orbits.first_time(level, theta + STEP * np.array([-1.0, 1.0]))
    change = np.array(
        [
            at.d_by[0][0] * arrival.I_slope + at.d_by[1][0] * arrival.b_slope,
            at.chi_by[0][0] * arrival.I_slope + at.chi_by[1][0] * arrival.b_slope,
            (late - early) / (2 * STEP),
        ]
    )
    found, scale = [], math.log10(abs(h_factor))
    for k in range(len(slopes) + 1):
        size = float(np.abs(change).max())
        change, scale = change / size, scale + math.log10(size)
        # A crossing moves by chi at a fixed time as much as by the time at a fixed chi.
        found.append(
            (scale + math.log10(abs(change[2])), np.sign(change[2]), change[1] / change[2])
        )
        if k < len(slopes):
            s = slopes[k]
            change = np.array([s[0] @ change[:2], s[1] @ change[:2], change[2] + s[2] @ change[:2]])
    exponent, sign, chi = np.array(found).T
    return Growth(exponent, sign * math.copysign(1, h_factor), chi)


def refined(orbits: Surface, solved: Solved, digits: int) -> Refined:
    """theta2_0 of a path to `digits` digits behind the point.

    Raises
    ------
    NoOrbit
        Integration of the full equations does not follow the path.
    """
    chain, level = solved.path.chain, solved.level
    factor = 1 - solved.by_energy * orbits.energy_slope(chain.unknown)
    grown = growth(orbits, solved, factor)
    begun = float(orbits.first_time(level, np.array([chain.unknown]))[0])
    times = begun + np.concatenate(([0.0], np.cumsum(chain.time)))
    reach = int((np.maximum.accumulate(grown.exponent) <= digits - 1).sum()) - 1
    fixed = int((np.maximum.accumulate(grown.exponent) <= digits - MARGIN).sum()) - 1
    bits = max(64, math.ceil(digits * math.log2(10)) + GUARD)
    begin = start(orbits.problem, bits, Scales())
    refiner = _Refiner(begin, times, grown, bits, digits, solved.path.symmetric)
    theta, delay = refiner.run(chain.unknown, max(reach, 0))
    return Refined(_decimal(theta, digits), max(fixed, 0), bits, delay, times)


class _Refiner(NamedTuple):
    """Integrations of one orbit, each with a better theta2_0."""

    begin: Start
    times: Array
    """Times t' of the crossings by the map."""
    grown: Growth
    bits: int
    digits: int
    symmetric: bool

    def run(self, theta2: float, reach: int) -> tuple[Fraction, float]:
        """The phase, and the largest delay on the way."""
        theta, error, delay = Fraction(theta2), math.log10(FIRST_ERROR), 0.0
        whole = self.symmetric and reach == len(self.times) - 1
        for _ in range(ROUNDS):
            until = min(reach, int((self.grown.exponent + error <= 0).sum()))
            note(lambda: f"theta2_0 to {-error:.0f} of {self.digits} digits, in {self.bits} bits")  # noqa: B023
            # Until the end no more than the next correction can use.
            bits = self.bits if until == reach else math.ceil((SPARE - error) * math.log2(10))
            late, height = self._late(theta, until, min(bits, self.bits))
            near = np.flatnonzero(np.logical_and.accumulate(np.abs(late) < FAR))
            if not near.size:
                raise NoOrbit("integration does not find the first crossing where the map has it")
            k = int(near[-1])
            last = whole and k == reach
            off = -height / Fraction(self.grown.chi[k]) if last else Fraction(late[k])
            step = -off / self._power(k)
            theta += step
            size = max(abs(float(off)) ** 2, 0.0 if last else FIRST_ERROR)
            exponent = float(self.grown.exponent[k])
            error = math.log10(max(size, 1e-300)) - exponent
            delay = float(np.abs(late[: max(k, 1)]).max())
            if k == reach and abs(step) < Fraction(1, 10 ** (self.digits + 1)):
                return theta, delay
        raise NoOrbit(f"integration follows the map up to crossing {k + 1} only")

    def _late(self, theta: Fraction, until: int, bits: int) -> tuple[Array, Fraction]:
        """Delays t' of the crossings, and gamma3 at the last of them.

        The orbit is followed in so many bits, and in fewer where its errors have grown.
        """
        c = self.begin.coefficients
        [state] = np.array(states_exact(self.begin, [exact(theta)], self.bits))
        times = [Fraction(0), *(Fraction(float(t)) for t in self.times[: until + 1])]
        spent = np.maximum.accumulate(np.append(0.0, self.grown.exponent[:until])) * math.log2(10)
        left = [rung(bits + ACROSS - x) for x in spent]
        rows: list[Any] = []
        for most, passages in itertools.groupby(range(until + 1), left.__getitem__):
            here = list(passages)
            since = [times[k + 1] - times[here[0]] for k in here]
            found = states_at(c, state[:, None], since, most)[..., 0]
            rows, state = [*rows, *found.T], found[:, -1]
        rates = [aligned(state, c) for state in rows]
        late = [-state[2] / rate[2] for state, rate in zip(rows, rates, strict=True)]
        height = rows[-1][5] + late[-1] * rates[-1][5]
        cos = 1 if float(rates[-1][5]) < 0 else -1
        return np.array([float(x) for x in late]), height * cos

    def _power(self, k: int) -> Fraction:
        """dt/dtheta2_0 at crossing k."""
        whole = math.floor(self.grown.exponent[k])
        part = Fraction(float(self.grown.sign[k]) * 10 ** float(self.grown.exponent[k] - whole))
        return part * Fraction(10) ** whole


def _decimal(theta: Fraction, digits: int) -> Decimal:
    """The phase in [0, 2 pi), rounded."""
    m = context(math.ceil((digits + 10) * math.log2(10)))
    turn = fraction(2 * m.pi, m.prec)
    rest = theta % turn
    with localcontext() as c:
        c.prec = digits + 10
        return (Decimal(rest.numerator) / Decimal(rest.denominator)).quantize(
            Decimal(1).scaleb(-digits)
        )
