"""Route codes of many orbits of one body and h0 that differ in theta2_0 and in J1_0."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.integrate.arithmetic import Arithmetic
from rigidpend.orbits.integrate.records import Crossings
from rigidpend.orbits.return_map import MapError
from rigidpend.routes import certainty, mapped
from rigidpend.routes.certainty import Decided
from rigidpend.routes.codes import MANY, Run, in_threads
from rigidpend.routes.cycle import symbols
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem, phase_rate
from rigidpend.routes.start import Scales, Start


class Cells(NamedTuple):
    """Codes of n orbits, as a plane's cells keep them."""

    codes: NDArray[np.uint8]
    """(n_symbols, n): 0 left, 1 right, 255 no symbol."""
    certain: NDArray[np.uint8]
    """(n,), the number of first symbols that are certain."""
    by_map: NDArray[np.bool_]
    """(n,), whether return maps found the orbit, not integration."""


class Plane:
    """Orbits on S1- of one body and h0 over theta2_0 and J1_0, computed some at a time.

    Parameters
    ----------
    body : Body
    h0 : number
    J1_0 : 2 doubles
        The least and the largest, dimensionless.
    n_symbols : int
    arithmetic : Arithmetic
        Engine, tolerance and precisions.
    orbits : int
        How many there are in all: many take return maps.
    jobs : int, optional
        Threads. No result depends on it.

    Raises
    ------
    ProblemError
        A value that is excluded.
    """

    def __init__(
        self,
        body: Body,
        h0: Scalar,
        J1_0: tuple[float, float],
        n_symbols: int,
        arithmetic: Arithmetic,
        orbits: int,
        jobs: int = 1,
    ) -> None:
        self.least, self.largest = (
            RouteProblem(body, exact(h0), exact(float(x)), n_symbols) for x in J1_0
        )
        self.arithmetic, self.orbits, self.jobs = arithmetic, orbits, jobs
        self.range = J1_0

    def cells(self, theta2_0: NDArray[np.float64], J1_0: NDArray[np.float64]) -> Cells:
        """Route codes of the orbits that start at (theta2_0, J1_0), (n,) each.

        The doubles are taken as exact; radians, and dimensionless. Raises Contradiction where
        maps and integration call different symbols of an orbit certain.
        """
        run = Run(self.least, Phases(theta2_0), self.arithmetic, self.jobs)
        integrated = IntegratedStarts(run, J1_0, self._with_action)
        rate, ladder = phase_rate(self.largest), self.arithmetic.precisions
        if self.orbits >= MANY and ladder[0] == 53:
            starts = mapped.Starts(J1_0, self.range[0], self.orbits)
            share = functools.partial(in_threads, self.jobs)
            try:
                maps = mapped.Maps(
                    self.largest, run.phases, starts, jobs=self.jobs, least_time=True
                )
                return cells_of(*mapped.decided_by(maps, integrated.crossings, rate, ladder, share))
            except MapError as reason:
                mapped.told(self.largest, self.orbits, str(reason))
        found = certainty.decide(integrated.crossings, theta2_0.size, rate, ladder)
        return cells_of(found, np.zeros(theta2_0.size, dtype=bool))

    def _with_action(self, J1_0: float) -> RouteProblem:
        return replace(self.least, J1_0=exact(float(J1_0)))


def cells_of(found: Decided, by_map: NDArray[np.bool_]) -> Cells:
    """The part of decided orbits that a plane keeps, by_map (n,)."""
    # Behind an uncertain symbol none is certain, so that their number says which.
    certain = found.certain.sum(axis=0)
    return Cells(symbols(found.crossings.separatrix), certain.astype(np.uint8), by_map)


class IntegratedStarts:
    """Integration of columns of one body whose J1_0 or h0 differ.

    Parameters
    ----------
    run : Run
        Its problem says how long to wait for a crossing.
    keys : (n,) array
        What differs: equal ones have the same problem.
    problem_of : callable
        The problem of a key.
    """

    def __init__(
        self, run: Run, keys: NDArray[Any], problem_of: Callable[[Any], RouteProblem]
    ) -> None:
        self.run, self.keys, self.problem_of = run, keys, problem_of

    def crossings(self, bits: int, scales: Scales, columns: Any) -> Crossings:
        """The crossings of those columns in `bits` bits, in t'."""
        return self.run.integrate(*self._begin(bits, scales, columns), bits, scales)

    def _begin(self, bits: int, scales: Scales, columns: Any) -> tuple[Start, Any]:
        """A start for coefficients and units, which the body decides, and the states."""
        keys, which = np.unique(self.keys[columns], return_inverse=True)
        order, begun = [], []
        for k, key in enumerate(keys):
            here = np.flatnonzero(which == k)
            order.append(here)
            one = self.run._replace(problem=self.problem_of(key))
            begun.append(one.begin(bits, scales, columns[here]))
        back = np.argsort(np.concatenate(order))
        return begun[0][0], _ordered([states for _, states in begun], back, bits)


def _ordered(parts: Sequence[Any], order: Any, bits: int) -> Any:
    """States in an order: (6, n) in doubles, or a list of those in more bits."""
    if bits == 53:
        return np.concatenate(parts, axis=1)[:, order]
    joined = [x for part in parts for x in part]
    return [joined[k] for k in order]
