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
from rigidpend.experiments.bench.problems import ASKED, Crossed, Stage, Task, stage, time_unit
from rigidpend.experiments.bench.solvers import Solver
from rigidpend.experiments.principal_axes import initial
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned
from rigidpend.numbers.exact import context, exact
from rigidpend.routes.start import Scales, start, states_double
from tests.orbits.integrate.problems import FIG4, GENERIC, needs_heyoka
from tests.strategies import aligned_from_body

pytestmark = needs_heyoka("the references in 113 bits")
SMALL = SimpleNamespace(orbits=3, turns=2, columns=3, n_symbols=3)

# JAX and CyRK compile for many seconds: they are tried on the codes alone, where installed.
SLOW = ("diffrax", "cyrk", "diffrax_two_tolerances", "cyrk_two_methods")
PAIRS = [
    (problem, name)
    for problem in ASKED
    for name in METHODS
    if problem in METHODS[name].answers and (name not in SLOW or problem == "codes")
]
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


@functools.cache
def answered(problem: str, name: str, tolerance: Any, threads: int = 1) -> Any:
    method = METHODS[name]
    entry = Entrant(tolerance, {**method.variants[0]})
    if method.family == "heyoka":
        # Of three orbits one comes after others; fewer lanes are compiled sooner.
        entry.setting["lanes"] = 2
        if not method.runs:
            entry.setting["parameters"] = problem in PARAMETERS
    solver = made(name, given(problem).task, entry, threads)
    first = solver.read(solver.solve())
    if problem == "free_body":
        np.testing.assert_array_equal(first, solver.read(solver.solve()), "it begins anew")
    return first


@pytest.fixture(scope="module")
def apart() -> Iterator[Executor]:
    """A process of its own: the memory of many compilers would slow the forks of this one."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as process:
        yield process


def errors_of(problem: str, name: str, tolerance: Any) -> dict[str, Any]:
    return given(problem).error(answered(problem, name, tolerance), given(problem).truth)


@pytest.mark.slow
@pytest.mark.parametrize(("problem", "name"), PAIRS)
def test_agrees_with_the_truth(apart: Executor, problem: str, name: str) -> None:
    for library in METHODS[name].libraries:
        pytest.importorskip(library)
    tolerance = None if METHODS[name].finest is None else TOLERANCE
    errors = apart.submit(errors_of, problem, name, tolerance).result()
    assert errors["error"] < BOUND[problem]
    assert errors.get("wrong_symbols", 0) == 0
    assert errors.get("undecided", 0) == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("problem", "name"),
    [
        *(("free_body", name) for name in ("aligned_batch", "heyoka_eq1")),
        ("precession_angle", "heyoka_principal"),
    ],
)
def test_two_threads_give_what_one_gives(apart: Executor, problem: str, name: str) -> None:
    one, two = (
        apart.submit(answered, problem, name, 1e-11, threads).result() for threads in (1, 2)
    )
    np.testing.assert_allclose(one, two, rtol=0, atol=1e-13)


@pytest.mark.parametrize("kind", ["motion", "routes"])
def test_threads_share_orbits_and_what_they_find_is_joined_in_its_order(kind: str) -> None:
    task = Task(kind, FIG4, np.arange(30.0).reshape(6, 5), np.arange(5.0))

    def adapter(part: Task, _: Any, factor: int) -> Solver:
        read = (lambda x: Crossed(x, 2 * x)) if kind == "routes" else (lambda x: x)
        return Solver(lambda: factor * part.states, read)

    solver = solvers.shared(adapter)(task, None, 3, factor=7)
    found = solver.read(solver.solve())
    answers = found[:2] if kind == "routes" else [found]
    for factor, answer in zip((7, 14), answers, strict=False):
        np.testing.assert_array_equal(answer, factor * task.states)


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


@pytest.mark.slow
@pytest.mark.parametrize("method", ["aligned_batch", "scipy_dop853"])
def test_a_tighter_tolerance_is_more_exact(apart: Executor, method: str) -> None:
    loose, tight = (apart.submit(errors_of, "free_body", method, x).result() for x in (1e-3, 1e-7))
    assert tight["error"] < loose["error"] / 50


def test_aligned_states_are_exact_beside_a_separatrix() -> None:
    """Where one component is a difference of nearly equal numbers."""
    body, half = GENERIC, GENERIC.alpha0 / 2
    state = np.array([[np.sin(half)], [np.cos(half) * (1 + 1e-9)], [0.3], [0.6], [0.0], [0.8]])
    found = aligned_states(body, state)
    rough = np.stack(aligned_from_body(state[:3], state[3:], body.alpha0, time_unit(body)))
    np.testing.assert_allclose(found, rough, rtol=0, atol=1e-15)
    M, gamma = body_from_aligned(Aligned(*found), body.alpha0, time_unit(body))
    np.testing.assert_allclose(np.concatenate((M, gamma)), state, atol=1e-15)
    # With mu = 0 the product of both is an integral, from the invariants of M, in 200 bits.
    m = context(200)
    A = [x.in_context(m) for x in body.A]
    M1, M2, M3 = (m.mpf(float(x)) for x in state[:3, 0])
    square, energy2 = M1**2 + M2**2 + M3**2, M1**2 / A[0] + M2**2 / A[1] + M3**2 / A[2]
    # Qp Qm = square/A3 - energy2: equal parts of M3 cancel.
    assert float(found[0, 0] * found[1, 0] / (square / A[2] - energy2)) == pytest.approx(
        1, rel=1e-15
    )


def test_the_start_in_principal_axes_is_that_of_the_aligned_components() -> None:
    task = problems.codes(SMALL)
    expected = states_double(start(task.problem, 53, Scales()), np.array([0.0, 0.1, 0.2]), 0.0)
    body = task.body
    found = aligned_from_body(task.states[:3], task.states[3:], body.alpha0, time_unit(body))
    np.testing.assert_allclose(np.stack(found), expected, atol=1e-15)
    random = problems.random_routes(task.problem, 4)
    one_by_one = initial(random.problem, [exact(float(x)) for x in random.theta2_0])
    np.testing.assert_allclose(random.states, np.array(one_by_one, dtype=float).T, atol=2e-16)


STATE = [0.5, 0.4, 1.2, 0.48, 0.6, 0.64, 0.1, -0.2]


@pytest.mark.parametrize("body", [FIG4, GENERIC], ids=["Fig. 4", "generic"])
@pytest.mark.parametrize("size", [6, 8])
def test_what_is_written_flat_agrees_with_the_field_and_takes_arrays_too(
    body: Any, size: int
) -> None:
    field, found = problems.FIELDS[size](*body.floats()), [0.0] * size
    written = solvers.flat(body, size)
    written(found, 0.0, STATE[:size], None)
    np.testing.assert_array_equal(found, field(STATE[:size]))
    orbits = np.random.default_rng(0).normal(size=(size, 5))
    rates = np.empty_like(orbits)
    written(rates, 0.0, orbits, None)
    np.testing.assert_allclose(rates, field(orbits), rtol=1e-14, atol=1e-15)
