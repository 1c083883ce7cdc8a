"""Starts of the orbits of Fig. 4 on the section of return maps, in the unit of a map's design."""

import functools
from typing import Any, NamedTuple

import numpy as np

from rigidpend.mechanics.equations import height
from rigidpend.numbers.exact import GUARD_BITS, context, exact
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map import MapError
from rigidpend.orbits.return_map.build import Design
from rigidpend.routes.phases import turned
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.run import Run


def check_start(problem: RouteProblem) -> None:
    """Raise MapError for starts beyond the section, nearer to the upper periodic orbit.

    Their components Q are also those of a start before the section, for which a map would take
    them.
    """
    if 2 * problem.J1_0.at(53) > problem.J2_0(53):
        raise MapError(
            f"J1_0 = {float(problem.J1_0)} is above J2_0/2: orbits that start beside the upper"
            " periodic orbit do not begin in the normal form, which is the lower one's"
        )


class MapStarts:
    """The starts of a run's orbits, as return maps of any design take them."""

    def __init__(self, run: Run) -> None:
        self.run = run

    @functools.cached_property
    def _actions(self) -> tuple[tuple[float, ...], Any]:
        """The different J1_0 of the starts, and for each orbit the index of its own, (n,)."""
        assert self.run.starts is not None
        J1_0, which = np.unique(self.run.starts.J1_0, return_inverse=True)
        return tuple(J1_0.tolist()), which

    def of(self, bits: int, design: Design, columns: Any) -> tuple[Any, Any, Any]:
        """Qp, the phase of entry and (energy - h0)/mu of some columns, (N,) each.

        Qp is in the design's unit, the phase in radians. Each design shifts phases by another
        `phase_shift` before they are rounded, so that cos and sin round differently.
        """
        a, problem, phases = precision(bits), self.run.problem, self.run.phases
        if self.run.starts is None:
            Qp, along, across = beginning(problem, design, bits)
        else:
            J1_0, which = self._actions
            each = beginning(problem, design, bits, J1_0)
            Qp, along, across = (x[which[columns]] for x in each)
        theta2 = phases.near[columns]
        shifted = theta2 + design.phase_shift
        # Knuth's two-sum: the exact error of the rounded sum, which is added to the rest.
        back = shifted - design.phase_shift
        lost = (theta2 - back) + (design.phase_shift - (shifted - back))
        rest = a.array(phases.rest[columns] + lost)
        cos, sin = turned(a.cos(a.array(shifted)), a.sin(a.array(shifted)), rest)
        # The reversor takes the start to one beside the upper orbit, psi = pi/2 - beta0/2 - theta2.
        # The angle is recovered from cos and sin, to which its rest has been added.
        beta0 = _constants(problem, bits).beta0
        psi = a.pi / 2 - beta0 / 2 - a.atan2(sin, cos) + design.phase_shift
        return Qp + 0 * psi, psi, along * cos + across * sin


class _Constants(NamedTuple):
    """Numbers of a problem's starts, each rounded once."""

    theta1: Any
    """alpha0 + beta0, radians."""
    sin_alpha0: Any
    beta0: Any
    J2: Any
    J1: Any


@functools.lru_cache(maxsize=16)
def _constants(problem: RouteProblem, bits: int) -> _Constants:
    """The numbers of a problem's starts in `bits` bits."""
    a, m = precision(bits), context(bits + 2 * GUARD_BITS)
    p, J2 = problem.body.angles(m.prec), problem.J2_0(m.prec)
    exactly = p.alpha0 + p.beta0, m.sin(p.alpha0), p.beta0, J2, problem.J1_0
    return _Constants(*map(a.number, exactly))


def start_Qp(problem: RouteProblem, unit: str, bits: int, J1_0: Any = None) -> Any:
    """Qp of starts in a design's unit of M, for the problem's J1_0 or for doubles in its place."""
    a, (_, sin_alpha0, _, J2, J1) = precision(bits), _constants(problem, bits)
    J1 = J1 if J1_0 is None else a.array(np.array(J1_0))[()]
    # That of `aligned_from_canonical` at theta1 = alpha0 + beta0. Maps share these numbers, and the
    # sine of a rounded alpha0 near pi would have few digits, the same wrong ones for all of them.
    return a.number(exact(unit)) * (2 * a.sqrt(J1) * a.sqrt(J2 - J1) * sin_alpha0)


class Beginning(NamedTuple):
    """Constants of the starts of a design, for one J1_0 or for each of several."""

    Qp: Any
    along: Any
    """Coefficient of the cosine of the shifted phase in (energy - h0)/mu."""
    across: Any
    """Coefficient of the sine of the shifted phase in (energy - h0)/mu."""


@functools.lru_cache(maxsize=16)
def beginning(
    problem: RouteProblem, design: Design, bits: int, J1_0: tuple[float, ...] | None = None
) -> Beginning:
    """The constants of the problem's starts, or of starts with the given J1_0, doubles."""
    a, (theta1, _, _, J2, J1) = precision(bits), _constants(problem, bits)
    J1 = J1 if J1_0 is None else a.array(np.array(J1_0))
    # The height is linear in cos and sin of the shifted phase: its values at 0 and pi/2 are the
    # coefficients.
    along, across = (
        height(J1, J2, (theta1, x - design.phase_shift), a) for x in (a.number(0.0), a.pi / 2)
    )
    return Beginning(start_Qp(problem, design.unit, bits, J1_0), along, across)
