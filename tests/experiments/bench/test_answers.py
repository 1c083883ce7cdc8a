"""Every method solves every problem that it says it answers, to what its knob promises."""

from __future__ import annotations

import functools
import multiprocessing
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.bench import problems, solvers
from rigidpend.experiments.bench.methods import METHODS, Entrant
from rigidpend.experiments.bench.ours import aligned_states
from rigidpend.experiments.bench.peers import compared, made
from rigidpend.experiments.bench.problems import ASKED, Crossed, Stage, stage, time_unit
from rigidpend.experiments.bench.solvers import Solver
from rigidpend.experiments.principal_axes import initial
from rigidpend.numbers.exact import context, exact
from rigidpend.routes.start import Scales, start, states_double
from tests.orbits.integrate.problems import FIG4, GENERIC, needs_heyoka
from tests.strategies import aligned_from_body

pytestmark = needs_heyoka("the references in 113 bits")
SMALL = SimpleNamespace(orbits=3, turns=2, columns=3, n_symbols=3)

# JAX and CyRK compile for many seconds: they are tried on the codes alone, where installed.
SLOW = ("diffrax", "cyrk", "diffrax_two_tolerances", "cyrk_two_methods")
CASES = [
    *(
        (problem, name, 1)
        for problem in ASKED
        for name in METHODS
        if problem in METHODS[name].answers and (name not in SLOW or problem == "codes")
    ),
    ("free_body", "aligned_batch", 2),
    ("free_body", "heyoka_eq1", 2),
    ("codes", "heyoka_principal", 2),
    ("precession_angle", "heyoka_principal", 2),
]
"""Problems, methods and numbers of threads."""
BOUND = {"free_body": 1e-6, "pendulum": 1e-6, "codes": 1e-3, "precession_angle": 2e-4}
TOLERANCE = 1e-11
"""A tolerance that should be good enough."""
PARAMETERS = ("pendulum", "codes")
"""Problems at which the numbers of the body are heyoka's parameters."""


@functools.cache
def given(problem: str) -> Stage:
    """The task and its truth; of Fig. 5 the first passage alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(problems, "FIG5", replace(problems.FIG5, n_symbols=1))
        return stage(problem, SMALL)


def errors_of(problem: str, name: str, threads: int) -> dict[str, Any]:
    method = METHODS[name]
    entry = Entrant(None if method.finest is None else TOLERANCE, {**method.variants[0]})
    if method.family == "heyoka":
        # Of three orbits one comes after others; fewer lanes are compiled sooner.
        entry.setting["lanes"] = 2
        if not method.runs:
            entry.setting["parameters"] = problem in PARAMETERS
    solver = made(name, given(problem).task, entry, threads)
    first = solver.read(solver.solve())
    if problem == "free_body":
        np.testing.assert_array_equal(first, solver.read(solver.solve()), "it begins anew")
    return given(problem).error(first, given(problem).truth)


@pytest.fixture(scope="module")
def apart() -> Iterator[Executor]:
    """A process of its own: the memory of many compilers would slow the forks of this one."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as process:
        yield process


@pytest.mark.slow
@pytest.mark.parametrize(("problem", "name", "threads"), CASES)
def test_agrees_with_the_truth(apart: Executor, problem: str, name: str, threads: int) -> None:
    for library in METHODS[name].libraries:
        pytest.importorskip(library)
    errors = apart.submit(errors_of, problem, name, threads).result()
    assert errors["error"] < BOUND[problem]
    assert errors.get("wrong_symbols", 0) == 0
    assert errors.get("undecided", 0) == 0


def test_a_cross_check_trusts_up_to_the_first_disagreement() -> None:
    """Two runs differ in a column; the third sides with the second up to its own difference."""
    task = problems.codes(SMALL)
    a = np.array([[0, 0, 1], [1, 1, 0], [0, 0, 1]], dtype=np.uint8)
    b, c = a.copy(), a[:, 1:2].copy()
    b[1, 1], c[1, 0], c[2, 0] = 0, 0, 1
    asked = []

    def run(codes: Any) -> Any:
        def make(part: Any) -> Solver:
            asked.append(part.theta2_0)
            return Solver(lambda: Crossed(codes, np.zeros((4, codes.shape[1]))), lambda x: x)

        return make

    solver = compared(task, run(a), run(b), run(c))
    found = solver.read(solver.solve())
    assert asked[2].tolist() == task.theta2_0[1:2].tolist()
    assert found.certain[:, 0].all()
    assert found.certain[:, 1].tolist() == [True, True, False]
    assert found.codes[:, 1].tolist() == [0, 0, 1]


def test_aligned_states_are_exact_beside_a_separatrix() -> None:
    """Where one component is a difference of nearly equal numbers."""
    body, half = GENERIC, GENERIC.alpha0 / 2
    state = np.array([[np.sin(half)], [np.cos(half) * (1 + 1e-9)], [0.3], [0.6], [0.0], [0.8]])
    found = aligned_states(body, state)
    rough = np.stack(aligned_from_body(state[:3], state[3:], body.alpha0, time_unit(body)))
    np.testing.assert_allclose(found, rough, rtol=0, atol=1e-15)
    # With mu = 0 the product of both is an integral, from the invariants of M, in 200 bits.
    m = context(200)
    A1, A2, A3 = (x.in_context(m) for x in body.A)
    M1, M2 = (m.mpf(float(x)) ** 2 for x in state[:2, 0])
    # Of |M|^2/A3 less twice the energy: equal parts of M3 cancel.
    expected = M1 * (1 / A3 - 1 / A1) + M2 * (1 / A3 - 1 / A2)
    assert float(found[0, 0] * found[1, 0] / expected) == pytest.approx(1, rel=1e-15)


def test_the_start_in_principal_axes_is_that_of_the_aligned_components() -> None:
    task, body = problems.codes(SMALL), FIG4
    expected = states_double(start(task.problem, 53, Scales()), np.array([0.0, 0.1, 0.2]), 0.0)
    found = aligned_from_body(task.states[:3], task.states[3:], body.alpha0, time_unit(body))
    np.testing.assert_allclose(np.stack(found), expected, atol=1e-15)
    random = problems.random_routes(task.problem, 4)
    one_by_one = initial(random.problem, [exact(float(x)) for x in random.theta2_0])
    np.testing.assert_allclose(random.states, np.array(one_by_one, dtype=float).T, atol=2e-16)


@pytest.mark.parametrize("body", [FIG4, GENERIC], ids=["Fig. 4", "generic"])
@pytest.mark.parametrize("size", [6, 8])
def test_what_is_written_flat_agrees_with_the_field_and_takes_arrays_too(
    body: Any, size: int
) -> None:
    field, written = problems.FIELDS[size](*body.floats()), solvers.flat(body, size)
    orbits = np.random.default_rng(0).normal(size=(size, 5))
    one, found, rates = orbits[:, 0].tolist(), [0.0] * size, np.empty_like(orbits)
    written(found, 0.0, one, None)
    np.testing.assert_array_equal(found, field(one))
    written(rates, 0.0, orbits, None)
    np.testing.assert_allclose(rates, field(orbits), rtol=1e-14, atol=1e-15)
