"""Stretching: how a deviation grows from passage to passage, by the map's derivatives.

A deviation is one of the place on the section M3 = 0, between orbits of one energy. Its size is
the Euclidean norm of the change of (M', gamma), both dimensionless: six numbers that everybody
has who integrates the equations of motion. The logarithm of its growth through some passages, a
passage, is a finite-time exponent, and tends to the Lyapunov exponent of the return map. Another
norm changes the logarithm by a bounded amount, however many passages there are.

Chains have it passage by passage, and many orbits of Fig. 4's kind at once, one for each theta2_0
and J1_0, held against the variational equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.equations import AlignedCoefficients, aligned, aligned_along
from rigidpend.numbers.generic import Array
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.orbits.return_map.passage import EnergyLevel
from rigidpend.orbits.return_map.poincare import section_state, section_tangents
from rigidpend.orbits.return_map.precision import precision
from rigidpend.orbits.return_map.reduced import Coefficients
from rigidpend.routes.symbolic.chain import Chain, carried, tangents
from rigidpend.routes.symbolic.levels import Mask, Surface, onward, widest_d

ROUNDINGS = 3
"""Roundings of doubles in a passage by the map: those of its sums, some 80 terms, mostly cancel."""
INTEGRATED = 0.1
"""Roundings in a passage that is integrated, in units of those by the map, where the layer is 1.

Integration rounds numbers of the order of 1, the map what is as small as the layer: the thinner it
is, the more roundings of the map are one of integration."""
BENDING = 3.0
"""Relative change of a growth by a change of the place of a crossing, in radians of chi.

Behind it the derivatives have harmonics of chi, whose relative change is as large as its own,
before it they have such too, and go with 1/U, whose relative change is Lambda < 1 times chi's."""


def stretching(chain: Chain) -> Array:
    """ln of the growth of a deviation in each passage of a chain, (n,), by its part in chi.

    The deviation begins along chi, and has turned to the growing direction behind the first
    passage, but for a share of 1/growth^2. There d changes by a share of chi of the order of mu.
    """
    changes, logs = carried(tangents(chain), np.array([0.0, 1.0, 0.0]))
    return np.asarray(np.diff(logs + np.log(np.abs(changes[:, 1]))))


def most_stretched(slopes: Sequence[Array], frames: Sequence[Array]) -> Array:
    """ln of the growth of the deviation that grows most, through 1 to n passages, (n, ...).

    Over the number of passages it is the finite-time exponent of whatever comes first. The slopes
    are the n derivatives (2, 2, ...) of d and chi behind each passage in d and chi before it, the
    frames n + 1 (2, 2, ...): `frame` at the first crossing, and behind each passage.
    """
    begun = np.moveaxis(frames[0], (0, 1), (-2, -1))
    whole = np.asarray(np.moveaxis(np.linalg.inv(begun), (-2, -1), (0, 1)), dtype=float)
    found = []
    for slope, behind in zip(slopes, frames[1:], strict=True):
        whole = product(slope, whole)
        found.append(np.log(largest_singular(product(behind, whole))))
    return np.array(found)


def frame(point: SectionPoint, h: Any, c: Coefficients) -> Array:
    """The matrices (2, 2, N) that make of changes of d and chi a vector as long as of (M', gamma).

    Energies h (N,) are dimensionless, the coefficients in doubles, with M' in its own unit.
    """
    moved = euclidean(section_tangents(*point, h, c, precision(53)), c)
    one, other = moved[:, 0], moved[:, 1]
    length = np.sqrt((one * one).sum(axis=0))
    along = (one * other).sum(axis=0) / length
    across = other - along * one / length
    rows = (length, along), (0 * length, np.sqrt((across * across).sum(axis=0)))
    return np.array(rows)


def euclidean(deviations: Array, c: Coefficients) -> Array:
    """Changes of (M', gamma) in principal axes from those of the aligned components, (6, ...)."""
    Qp, Qm, *others = deviations
    return np.stack(((Qp + Qm) * c.to_M1, (Qp - Qm) * c.to_M2, *others))


def product(one: Array, other: Array) -> Array:
    """Products (2, 2, ...) of matrices (2, 2, ...)."""
    return np.asarray(np.einsum("ij...,jk...->ik...", one, other))


def largest_singular(matrix: Any) -> Any:
    """The larger singular value of matrices with two rows of two numbers or arrays."""
    (a, b), (c, d) = matrix
    return (np.hypot(a + d, b - c) + np.hypot(a - d, b + c)) / 2


class Stretched(NamedTuple):
    """N orbits of a body through n passages with the growth of a deviation, one in each column.

    The level is the map at the energy of each orbit, `begin` their first crossings. The last four
    are t' from the first crossing to the last, (N,); the symbols (n, N); ln of the growth of the
    deviation that grows most, through 1 to n passages (n, N); the bound of its rounding through all
    of them (N,). Where the tables do not reach so far an orbit is not `inside`, and the rest void.
    """

    level: EnergyLevel
    coefficients: Coefficients
    begin: SectionPoint
    inside: Mask
    time: Array
    symbols: NDArray[np.uint8]
    growth: Array
    allowed: Array

    @property
    def integrated(self) -> Array:
        """The bound of the rounding of :func:`integrated`, (N,)."""
        return INTEGRATED / widest_d(self.level) * self.allowed


def stretched(orbits: Surface, theta2_0: Array, J1_0: Array, n: int) -> Stretched:
    """Follow orbits of one body and h0 through n passages, from phases and actions (N,)."""
    level, c = orbits.made.at(orbits.energy(theta2_0, J1_0)), orbits.made.coefficients
    begin = orbits.enter(level, theta2_0, J1_0)
    # What lies outside of the tables may have no energy there.
    first = begin.point._replace(d=np.where(begin.inside, begin.point.d, 0.0))
    passed = list(onward(level, first, n, slopes=True))
    slopes = [each.slopes[:2] for each in passed]
    frames = [frame(point, level.h, c) for point in (first, *(each.point for each in passed))]
    inside = np.logical_and.reduce([begin.inside, *(each.inside for each in passed)])
    time = sum(each.time for each in passed)
    codes = np.array([each.symbol for each in passed], dtype=np.uint8)
    grown = most_stretched(slopes, frames)
    allowed = rounding(slopes, widest_d(level), grown[-1])
    return Stretched(level, c, first, inside, time, codes, grown, allowed)


def rounding(slopes: list[Array], width: float, grown: Array) -> Array:
    """Allowed error of ln of the growth through all passages, (N,): a bound by theory.

    In each passage the place on the section errs by `ROUNDINGS`, of chi in radians and of d in
    widths of the layer. The error grows as deviations do from there to the next crossings. At
    each it changes the derivatives by `BENDING`, and the growth through all passages by the
    product of those before it and behind it over the whole. That is exp(grown), of the norm that is
    told: of a change of d by a width it is `width` times as much, and where deviations shrink again
    far less than the product in widths.
    """
    n, unit = len(slopes), np.array([width, 1.0])
    scaled = [slope * (unit / unit[:, None])[..., None] for slope in slopes]
    norm = np.ones((n + 1, n + 1, scaled[0].shape[-1]))
    for j in range(n):
        whole = np.broadcast_to(np.eye(2)[..., None], scaled[j].shape)
        for k in range(j, n):
            whole = product(scaled[k], whole)
            norm[j, k + 1] = largest_singular(whole)
    place = ROUNDINGS * 2.0**-53 * np.array([norm[: k + 1, k].sum(axis=0) for k in range(n + 1)])
    whole = width * np.exp(grown)
    return np.asarray((BENDING * place * norm[0] * norm[:, n] / whole).sum(axis=0))


def integrated(found: Stretched) -> Array:
    """ln of the growth through all passages, by the variational equations, (N,)."""
    c, a, at = found.coefficients, precision(53), (*found.begin, found.level.h)
    begun, off = section_state(*at, found.coefficients, a), section_tangents(*at, c, a)
    unit = np.linalg.inv(np.moveaxis(frame(found.begin, found.level.h, c), -1, 0))
    ended = []
    for beside in np.einsum("ijn,njk->kin", off, unit):
        rates, states = variational_equations(c.aligned), np.concatenate((begun, beside))
        end = states_at(rates, states, found.time[None])[:, 0]
        flow = np.array(aligned(end[:6], c.aligned))
        # Back to the section along the orbit.
        ended.append(euclidean(end[6:] - flow * (end[8] / flow[2]), c))
    one, other = ended
    sizes = (one * one).sum(axis=0), (other * other).sum(axis=0)
    both = np.hypot(sizes[0] - sizes[1], 2 * (one * other).sum(axis=0))
    return np.asarray(np.log((sum(sizes) + both) / 2) / 2)


def variational_equations(c: AlignedCoefficients) -> Any:
    """The field of the aligned components with a deviation from them, 12 numbers, per t'."""

    def rates(state: Any) -> tuple[Any, ...]:
        return (*aligned(state[:6], c), *aligned_along(state[:6], state[6:], c))

    return rates
