"""Cross-checks of peers: two runs compared, and a third where they differ.

A symbol is trusted where two runs agree on it and on all before it. Where the first two differ the
third decides, if it agrees with one of them. Nothing tells how near an agreement must be, as it
does for ours: runs of one formulation err alike.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rigidpend.experiments.bench.measuring.tasks import (
    Crossed,
    RouteTask,
    Solver,
    orbits_of,
)

Make = Callable[[RouteTask], Solver]


def compared(task: RouteTask, first: Make, second: Make, third: Make) -> Solver:
    """Run twice, compare, and run the columns that differ a third time.

    Parameters
    ----------
    task : RouteTask
    first, second, third : callable
        Each gives a solver of a task, as a method's function does.
    """
    solvers = [first(task), second(task)]

    def solve() -> Crossed:
        a, b = (solver.read(solver.solve()) for solver in solvers)
        trusted = np.logical_and.accumulate(a.codes == b.codes, axis=0)
        codes, doubtful = a.codes.copy(), np.flatnonzero(~trusted.all(axis=0))
        if doubtful.size:
            # What is compiled for other orbits serves these; only their states are new.
            again = third(orbits_of(task, doubtful))
            c = again.read(again.solve())
            for other in (a, b):
                same = np.logical_and.accumulate(other.codes[:, doubtful] == c.codes, axis=0)
                trusted[:, doubtful] |= same
            codes[:, doubtful] = c.codes
        return Crossed(codes, a.time, trusted)

    return Solver(solve, lambda found: found)


def heyoka_two_forms(task: RouteTask, _: None, threads: int) -> Solver:
    """Euler-Poisson and (eq1), each to rounding; then Euler-Poisson at another tolerance."""
    from rigidpend.experiments.bench.measuring.methods.plain_heyoka import (
        eq1_codes,
        principal_codes,
    )

    return compared(
        task,
        lambda part: principal_codes(part, 2.0**-52, threads),
        lambda part: eq1_codes(part, 2.0**-52, threads),
        lambda part: principal_codes(part, 1e-14, threads),
    )


def heyoka_two_tolerances(task: RouteTask, _: None, threads: int) -> Solver:
    """Euler-Poisson to rounding and at another tolerance; then (eq1)."""
    from rigidpend.experiments.bench.measuring.methods.plain_heyoka import (
        eq1_codes,
        principal_codes,
    )

    return compared(
        task,
        lambda part: principal_codes(part, 2.0**-52, threads),
        lambda part: principal_codes(part, 1e-14, threads),
        lambda part: eq1_codes(part, 2.0**-52, threads),
    )


def cyrk_two_methods(task: RouteTask, _: None, threads: int) -> Solver:
    """DOP853 and Verner's order 8 of CyRK; then DOP853 at another tolerance."""
    from rigidpend.experiments.bench.measuring.methods import cyrk_compiled as cyrk

    def run(tolerance: float, method: str) -> Make:
        return lambda part: cyrk.codes(part, tolerance, threads, method)

    return compared(task, run(1e-13, "DOP853"), run(1e-13, "Vern8"), run(3e-14, "DOP853"))


def diffrax_two_tolerances(task: RouteTask, _: None, threads: int) -> Solver:
    """diffrax at two tolerances; then with another method."""
    from rigidpend.experiments.bench.measuring.methods import diffrax_vmapped

    def run(tolerance: float, solver: str) -> Make:
        return lambda part: diffrax_vmapped.codes(part, tolerance, threads, solver)

    return compared(task, run(1e-13, "Dopri8"), run(3e-14, "Dopri8"), run(1e-12, "Dopri5"))


def scipy_two_tolerances(task: RouteTask, _: None, threads: int) -> Solver:
    """DOP853 of SciPy at two tolerances, abreast; then one orbit after the other."""
    from rigidpend.experiments.bench.measuring.methods import scipy_ivp

    def run(tolerance: float, abreast: bool) -> Make:
        return lambda part: scipy_ivp.codes(part, tolerance, threads, "DOP853", abreast)

    return compared(task, run(1e-12, True), run(1e-13, True), run(1e-13, False))
