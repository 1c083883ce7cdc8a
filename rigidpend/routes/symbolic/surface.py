"""The orbits of Fig. 4 as the beginning of a chain: one for each phase theta2_0 on S1-."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rigidpend.mechanics.equations import hamiltonian_J3_0
from rigidpend.numbers.doubles import Array
from rigidpend.orbits.return_map import MapError, ReturnMap, return_map
from rigidpend.orbits.return_map.conjugacy import inverted
from rigidpend.orbits.return_map.passage import EnergyLevel, Entered
from rigidpend.routes.mapped import start_Qp
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.symbolic.chain import Arrival
from rigidpend.routes.symbolic.tables import Level

STEP = 1e-4
"""Step of the differences in theta2_0, radians: its square is the error of a slope."""


class Surface(NamedTuple):
    """Orbits that start at theta1_0 = alpha0 + beta0, J1_0 and J2_0 = sqrt(2 h0/kappa)."""

    problem: RouteProblem
    made: ReturnMap
    """Over the energies of all phases."""

    def level(self, h: float) -> Level:
        """The map at one energy."""
        return Level(self.made, h)

    def energy(self, theta2: float) -> float:
        """The energy of the orbit of a phase (eq. h0_new), dimensionless."""
        return float(self.energies(theta2, float(self.problem.J1_0.at(53))))

    def energies(self, theta2: Any, J1_0: Any) -> Any:
        """The energies of orbits with other J1_0, arrays."""
        p, J2 = self.problem.body.angles(), float(self.problem.J2_0(53))
        return hamiltonian_J3_0(J1_0, J2, (p.alpha0 + p.beta0, theta2), p, np)

    def first_crossings(self, theta2: Array, J1_0: Array) -> tuple[EnergyLevel, Entered]:
        """The first crossings of orbits with other J1_0, and the map at the energy of each."""
        level = self.made.at(self.energies(theta2, J1_0))
        Qp = start_Qp(self.problem, "1", 53, J1_0)
        return level, level.enter(Qp, self._phase(theta2))

    def energy_slope(self, theta2: float) -> float:
        """Its derivative, per radian."""
        return (self.energy(theta2 + STEP) - self.energy(theta2 - STEP)) / (2 * STEP)

    def begin(self, level: Level) -> Callable[[float], Arrival]:
        """The arrival of the orbit of a phase, at a given energy."""

        def arrival(theta2: float) -> Arrival:
            I, b = self._entered(level, theta2 + STEP * np.array([-1.0, 0.0, 1.0]))
            return Arrival(I[1], b[1], (I[2] - I[0]) / (2 * STEP), (b[2] - b[0]) / (2 * STEP))

        return arrival

    def first_time(self, level: Level, theta2: Array) -> Array:
        """t' of the first crossings."""
        entered = level.map_level.enter(start_Qp(self.problem, "1", 53), self._phase(theta2))
        return np.asarray(entered.time)

    def _entered(self, level: Level, theta2: Array) -> tuple[Array, Array]:
        """I and b of the mirrored starts."""
        made, phase, zero = level.map_level, self._phase(theta2), 0 * theta2
        Qp = start_Qp(self.problem, "1", 53)
        at = inverted(made.nf, made.weights, phase, zero + Qp, zero, made.a)
        if np.abs(at.v).max() > made.nf.radius:
            raise MapError(f"J1_0 = {self.problem.J1_0} lies outside of the normal form")
        I = at.u * at.v
        return I, -(phase + np.log(at.v) / level.rates(I).exponent)

    def _phase(self, theta2: Array) -> Array:
        found: Array = math.pi / 2 - self.problem.body.angles().beta0 / 2 - theta2
        return found


@functools.lru_cache(maxsize=8)
def surface(problem: RouteProblem) -> Surface:
    """The orbits of a problem with their map.

    Raises
    ------
    MapError
        They have none; the message gives the reason.
    """
    return Surface(problem, return_map(problem.body, h=problem.energies))
