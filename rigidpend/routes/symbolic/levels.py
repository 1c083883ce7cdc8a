"""The return map at one energy as chains use it, and the orbits of Fig. 4 as their beginnings.

A :class:`ChainLevel` looks up the values and derivatives of the inverse charts together, in
doubles. A :class:`OrbitFamily` holds the orbits on S1-, one for each phase theta2_0.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import hamiltonian_J3_0
from rigidpend.numbers import Array, Scalar
from rigidpend.numbers.exact import GUARD_BITS, exact
from rigidpend.orbits.precision import Precision, precision
from rigidpend.orbits.return_map import (
    EnergyLevel,
    MapError,
    Passage,
    ReturnMap,
    SectionPoint,
    return_map,
)
from rigidpend.orbits.return_map.build import WITH_THETA3
from rigidpend.orbits.return_map.conjugacy import TorusRates
from rigidpend.orbits.return_map.passage import Entered
from rigidpend.orbits.return_map.reduced import coefficients
from rigidpend.routes.map_start import check_start, start_Qp
from rigidpend.routes.problem import RouteProblem

Mask: TypeAlias = NDArray[np.bool_]
Signs: TypeAlias = NDArray[np.int64]

SPLITTING_PHASES = 128
"""Number of phases at which the splitting is evaluated."""
MOST_ROUNDINGS = 30
"""Largest number of roundings that displace an orbit: 10 were seen with 100 random bodies."""
STEP = 1e-4
"""Step of the differences in theta2_0, radians; the error of a derivative is of its square."""


class PassageEnds(NamedTuple):
    """Crossings as functions of I and an angle at an end of their passages, all of one shape."""

    chi: Array
    """Radians, whole turns included."""
    d: Array
    """Dimensionless."""
    constant: Array
    """Part of the passage's time, t', that belongs to this end."""
    chi_by: Array
    """(2, ...) derivatives of chi in I and in the angle."""
    d_by: Array
    """(2, ...) derivatives of d in I and in the angle."""


def onward(
    level: EnergyLevel, point: SectionPoint, n: int, slopes: bool = False
) -> Iterator[Passage]:
    """The n passages that follow crossings, one after the other."""
    for _ in range(n):
        passed = level.passage(point, slopes=slopes)
        yield passed
        point = passed.point


def each_alone(level: EnergyLevel, d: Array, chi: Array) -> Passage:
    """The passages behind crossings (n,), which are upward and downward by turns.

    Each is followed from its own crossing. Their slopes are (n, 4, 2), a matrix for each passage;
    `point`, the next crossing, is left out: None.
    """
    up, down = (
        level.passage(SectionPoint(k == 0, d[k::2], chi[k::2]), slopes=True) for k in (0, 1)
    )

    def woven(even: Array, odd: Array) -> Array:
        """One array whose last axis has entries of both by turns."""
        found = np.empty((*even.shape[:-1], len(d)), dtype=even.dtype)
        found[..., ::2], found[..., 1::2] = even, odd
        return found

    *others, slopes = map(woven, up[1:], down[1:])
    return Passage._make([None, *others, np.ascontiguousarray(np.moveaxis(slopes, -1, 0))])


def displacement(widest: float, split: float, bits: int) -> float:
    """Largest displacement of an orbit on a surface by roundings in `bits` bits, radians.

    `widest` is the largest |d| of tables and `split` the splitting of the surface, as |I|.
    """
    # Tables round by `widest` 2^-bits what changes by `split` in a radian of a surface.
    return math.ldexp(MOST_ROUNDINGS * widest / split, -bits)


class ChainLevel:
    """The return map of a body at one energy, in the form in which chains use it.

    `widest_I` and `widest_d` are the largest |I| and |d| of the tables; the latter is the unit of d
    in Newton's method and of its roundings. `splitting` is the largest
    |I| behind crossings on the unstable surface of the lower orbit, which are upward, and
    `downward_splitting` that of the upper orbit: it is smaller, and in the Hess case a rounding.
    `shift` is the growth of chi beyond -ln|I|/Lambda in a passage between multiples of pi, radians.
    `c` are the body's coefficients in doubles.
    """

    def __init__(self, made: ReturnMap, h: Scalar) -> None:
        self.made, self.body, self.energy, self.h = made, made.body, exact(h), float(h)
        self.c = coefficients(made.body.angles(53 + GUARD_BITS), "1", precision(53))
        level = self.map_level = made.at(self.h)
        self.widest_I = min(float(chart.inverse.width) for chart in level.charts)
        self.widest_d = max(float(chart.forward.width) for chart in level.charts)
        self.exponent = float(level.exponent[0, 0])
        self.splitting = self._split(True)
        # At least a rounding of d, so that nothing is divided by 0 in the Hess case.
        self.downward_splitting = max(self._split(False), math.ldexp(self.widest_d, -53))
        self.shift = float(np.diff(self.crossings([True, False], True, 0.0, 0.0).chi)[0])

    @staticmethod
    def of(body: Body, h: Scalar) -> ChainLevel:
        """The level of a body at an energy, physical units; MapError where it has no map."""
        return ChainLevel(return_map(body, h=h), h)

    def _split(self, rising: bool) -> float:
        """The largest |I| behind crossings on an unstable surface, upward or downward ones."""
        # On the surface the passage before has I = 0. Behind a downward crossing comes a passage
        # past the lower orbit: U and V are those of its reversed image, with -chi for chi.
        level, turn = self.map_level, 1 if rising else -1
        on = self.crossings(rising, not rising, 0.0, np.linspace(0, 2 * np.pi, SPLITTING_PHASES))
        U, V, *_ = level.charts[rising].forward.look_up(on.d, turn * on.chi, level.a)
        return float(np.abs(U * V).max())

    def midlines(self, rising: Mask, chi: Any, h: Any, a: Precision) -> Any:
        """The d from which tables count it, at crossings of an energy h: (n,) as all but h.

        `chi`, radians, and h are numbers of the precision `a`.
        """
        found = a.zeros((len(chi),))
        if self.made.design.narrower:
            low, high = map(a.number, self.made.energies)
            energy = a.array([(2 * h - low - high) / (high - low)])
            for kind in (False, True):
                here = rising == kind
                found[here] = self.made.midline(kind, chi[here], energy, a)
        return found

    def rates(self, I: Array) -> TorusRates:
        """Lambda(I) and the mean dt'/dchi, in the shape of I."""
        found = self.map_level.rates(I.ravel())
        return TorusRates(*(x.reshape(I.shape) for x in found))

    def crossings(self, rising: Any, upper: Any, I: Any, angle: Any) -> PassageEnds:
        """The crossings, `rising` or not, at one end of passages past the `upper` or lower orbit.

        All four arguments broadcast with each other; angles are in radians.
        """
        # The lower periodic orbit is the image of the upper one in the reversor: angles and times
        # change their sign, d and I do not.
        rising, upper, I, angle = np.broadcast_arrays(rising, upper, I, angle)
        side, level = np.where(upper, 1.0, -1.0), self.map_level
        value, by_I, by_angle = seen = np.empty((3, 4, *I.shape))
        for kind in (False, True):
            here = rising == kind
            if here.any():
                table = level.charts[kind].inverse
                found = table.look_up_slopes(I[here], (side * angle)[here], level.a)
                seen[..., here] = np.array(found)
        return PassageEnds(
            angle + side * value[1],
            value[0],
            side * value[2],
            np.array((side * by_I[1], 1 + by_angle[1])),
            np.array((by_I[0], side * by_angle[0])),
        )

    def arriving(self, I: Any, b: Any) -> PassageEnds:
        """Upward crossings at the ends of passages past the lower periodic orbit."""
        return self.crossings(True, False, np.atleast_1d(I), np.atleast_1d(b))

    def invariants(self, signs: Signs, growth: Array) -> tuple[Array, Array]:
        """I of passages in which the angle grows by `growth`, radians, and its derivative.

        Beyond the tables' range I is the end of the range, so that an iteration may come back.
        """
        # Newton's method for growth = -ln|I|/Lambda(I), in relative changes of |I|, which stays
        # positive that way.
        size = np.minimum(np.exp(-growth * self.exponent), self.widest_I)
        slope = size
        for _ in range(8):
            I = np.asarray(signs * size, dtype=float)
            rates = self.rates(I)
            depth = -np.log(size) / rates.exponent
            slope = -1 / (1 / (I * rates.exponent) + depth * rates.exponent_slope / rates.exponent)
            ratio = np.clip(slope * (growth - depth) / I, -0.9, 9.0)
            before, size = size, np.minimum(size * (1 + ratio), self.widest_I)
            # Roundings of ln|I|, which is up to some 40, go on to change |I| by a few 1e-15.
            if np.abs(size / before - 1).max(initial=0.0) < 1e-14:
                break
        return np.asarray(signs * size, dtype=float), slope

    def narrowest(self, signs: Signs) -> float:
        """The least splitting, as |I|, of the surfaces where orbits change sides.

        These are the crossings between passages whose I have different signs.
        """
        changed = signs[1:] != signs[:-1]
        # Crossing 1, behind the first passage, is downward, and then every second one.
        return self.downward_splitting if changed[::2].any() else self.splitting

    def displaced(self, bits: int, split: float | None = None) -> float:
        """Largest displacement of an orbit on a surface by roundings in `bits` bits, radians.

        `split` is the splitting of that surface, as |I|; by default that of the lower orbit.
        """
        return displacement(self.widest_d, self.splitting if split is None else split, bits)

    def half_turns(self, I: float) -> float:
        """The half rotations, any real number, of a passage with |I| between multiples of pi."""
        return (-math.log(abs(I)) / self.exponent + self.shift) / math.pi

    def fewest_half_turns(self, split: float) -> int:
        """The least number of half rotations of passages between surfaces with this splitting."""
        # Crossings at both ends change I by the splitting at most, so that |I| is at most twice it.
        return math.floor(self.half_turns(2 * split))

    def invariant(self, half_turns: float) -> float:
        """The |I| of passages with so many half rotations: the inverse of :meth:`half_turns`."""
        return math.exp((self.shift - math.pi * half_turns) * self.exponent)


class Arrival(NamedTuple):
    """The passage before the first crossing, as a function of one parameter: numbers or arrays."""

    I: Any
    b: Any
    """The angle at the end of the passage, radians."""
    I_slope: Any
    """Derivative of I in the parameter."""
    b_slope: Any
    """Derivative of b in the parameter."""


class OrbitFamily(NamedTuple):
    """The orbits of a problem, one for each phase theta2_0, with their return map."""

    problem: RouteProblem
    return_map: ReturnMap
    """The return map over the energies of all phases."""

    def energy(self, theta2: Any, J1_0: Any = None) -> Any:
        """The energies of orbits by their phases (eq. h0_new), for the problem's J1_0 or others."""
        p, J2 = self.problem.body.angles(), float(self.problem.J2_0(53))
        J1 = float(self.problem.J1_0.at(53)) if J1_0 is None else J1_0
        return hamiltonian_J3_0(J1, J2, (p.alpha0 + p.beta0, theta2), p, np)

    def energy_slope(self, theta2: float) -> float:
        """Derivative of the energy in theta2, per radian."""
        return float(self.energy(theta2 + STEP) - self.energy(theta2 - STEP)) / (2 * STEP)

    def enter(self, level: EnergyLevel, theta2: Array, J1_0: Any = None) -> Entered:
        """The first crossings of orbits by their phases, at the energies of the level."""
        return level.enter(start_Qp(self.problem, "1", 53, J1_0), self._phase(theta2))

    def begin(self, level: ChainLevel) -> Callable[[float], Arrival]:
        """The arrival of the orbit of a phase, as a function of theta2, at the level's energy."""
        made, Qp = level.map_level, start_Qp(self.problem, "1", 53)

        def arrival(theta2: float) -> Arrival:
            """The passage before the first crossing of the orbit with this phase, radians."""
            # I and b of the mirrored starts, with central differences for their derivatives.
            phase = self._phase(theta2 + STEP * np.array([-1.0, 0.0, 1.0]))
            at, inside = made.started(Qp, phase)
            J1 = f"J1_0 = {self.problem.J1_0}"
            if not inside.all():
                raise MapError(f"{J1} lies outside of the normal form: take a smaller one")
            # Of v, which is proportional to J1, the logarithm is taken.
            if at.v.min() < np.finfo(float).tiny:
                raise MapError(f"{J1} is too small for the doubles of the return map: take more")
            I = at.u * at.v
            b = -(phase + np.log(at.v) / level.rates(I).exponent)
            return Arrival(I[1], b[1], (I[2] - I[0]) / (2 * STEP), (b[2] - b[0]) / (2 * STEP))

        return arrival

    def _phase(self, theta2: Array) -> Array:
        """psi of the mirrored starts, radians."""
        found: Array = math.pi / 2 - self.problem.body.angles().beta0 / 2 - theta2
        return found


@functools.lru_cache(maxsize=8)
def orbits_of(problem: RouteProblem, fewer: int = 0) -> OrbitFamily:
    """The orbits of a problem with their map; MapError, with the reason, where they have none.

    Its tables are by `fewer` bits narrower than the displacement of the surfaces.
    """
    check_start(problem)
    design = WITH_THETA3._replace(narrower=fewer)
    return OrbitFamily(problem, return_map(problem.body, h=problem.energies, design=design))
