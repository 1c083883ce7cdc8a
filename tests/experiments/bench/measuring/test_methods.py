"""Every method solves every problem that it says it answers, to what its knob promises."""

from __future__ import annotations

import functools
import multiprocessing
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.special import ellipj, ellipkinc

from rigidpend.experiments.bench.measuring import fields, methods, problems
from rigidpend.experiments.bench.measuring.methods import METHODS
from rigidpend.experiments.bench.measuring.problems import NAMES
from rigidpend.experiments.bench.measuring.tasks import (
    Carrier,
    Crossed,
    Solver,
    aligned_states,
    direction,
    moments,
    time_unit,
)
from rigidpend.experiments.principal_axes import initial
from rigidpend.mechanics.coordinates import Aligned, aligned_from_body, body_from_aligned
from rigidpend.mechanics.equations import energy
from rigidpend.mechanics.hodograph import field as aligned_with_angles
from rigidpend.numbers.exact import context
from rigidpend.routes.start import Scales, start, states_double
from tests.orbits.integrate.problems import GENERIC, needs_heyoka

pytestmark = needs_heyoka("the references in 113 bits")
SMALL = SimpleNamespace(orbits=3, turns=2, columns=3, n_symbols=3, companions=2, periods=3)

# JAX and CyRK compile for many seconds; both are tried on the codes below, where installed.
SLOW = ("diffrax", "cyrk", "diffrax_two_tolerances", "cyrk_two_methods")
HERE = [name for name, method in METHODS.items() if not method.absent() and name not in SLOW]
PAIRS = [
    (problem, method)
    for problem in NAMES
    for method in HERE
    if METHODS[method].answer(problem, problems.module(problem).KIND)
    # Chaos makes 1e-7 of a low order an error of the size of alpha.
    and not (problem == "precession_angle" and method in ("scipy_radau", "cvode"))
]
BOUND = {
    "free_body": 1e-6,
    "pendulum": 1e-6,
    "codes": 1e-3,
    "precession_angle": 2e-4,
    "long_time": 1e-6,
}
BEST: dict[str, dict[str, Any]] = {"lie_poisson": {"order": 8}, "cvode": {"method": "Adams"}}
"""The variant that should be good enough; else the first."""


@functools.cache
def given(problem: str) -> tuple[Any, Any]:
    """The task and its truth."""
    task = problems.module(problem).task(SMALL)
    return task, problems.module(problem).reference(task)


def answered(problem: str, name: str, knob: Any, threads: int = 1, form: int = 0) -> Any:
    method, kind = METHODS[name], problems.module(problem).KIND
    answer = method.answer(problem, kind)
    assert answer is not None
    setting = {**method.forms[form], **BEST.get(name, method.variants[0])}
    solver = methods.function(answer, threads, setting)(given(problem)[0], knob)
    if isinstance(solver, Carrier):
        solver.start()
        solver.to(given(problem)[0].end)
        return solver.states()
    return solver.read(solver.solve())


def fine(method: str) -> Any:
    """A knob that should be good enough."""
    tolerance = {"scipy_radau": 1e-7}.get(method, 1e-11)
    return {"steps": 24, "none": None, "tolerance": tolerance}[METHODS[method].knob]


@pytest.fixture(scope="module")
def apart() -> Iterator[Executor]:
    """A process of its own: the memory of many compilers would slow the forks of this one."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as process:
        yield process


def errors_of(problem: str, name: str, form: int = 0) -> dict[str, Any]:
    """What an answer errs by."""
    found = answered(problem, name, fine(name), form=form)
    if problem != "long_time":
        return dict(problems.module(problem).error(found, given(problem)[1]))
    M, gamma, body = found[:3], found[3:], given(problem)[0].body
    end = energy(M, gamma, moments(body), direction(body), float(body.mu))
    return {"error": np.abs(end / given(problem)[1]["energy"] - 1).max()}


@pytest.mark.slow
@pytest.mark.parametrize(("problem", "method"), PAIRS)
def test_agrees_with_the_truth(apart: Executor, problem: str, method: str) -> None:
    check(problem, method, apart.submit(errors_of, problem, method).result())


def check(problem: str, method: str, errors: dict[str, Any]) -> None:
    """The answer is true, to what its knob promises."""
    # Methods of low order would take too long for more; a peer's (eq1) starts from rounded J1.
    low = method in ("scipy_radau", "cvode") and problem != "long_time"
    loose = 100 if low else 1
    assert errors["error"] < loose * BOUND[problem]
    assert errors.get("wrong_symbols", 0) == 0
    assert errors.get("undecided", 0) == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["heyoka_principal", "heyoka_eq1", "scipy_dop853"])
@pytest.mark.parametrize("problem", ["free_body", "codes"])
def test_every_form_agrees_with_the_truth(apart: Executor, problem: str, name: str) -> None:
    for form in range(len(METHODS[name].forms)):
        check(problem, name, apart.submit(errors_of, problem, name, form).result())


@pytest.mark.parametrize(
    "name", ["aligned_batch", "heyoka_principal", "heyoka_eq1", "heyoka_ensemble"]
)
def test_two_threads_give_what_one_gives(name: str) -> None:
    one, two = (answered("free_body", name, 1e-9, threads) for threads in (1, 2))
    np.testing.assert_allclose(one, two, rtol=0, atol=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in SLOW if not METHODS[name].absent()])
def test_what_compiles_long_agrees_on_the_codes(apart: Executor, name: str) -> None:
    check("codes", name, apart.submit(errors_of, "codes", name).result())


def test_a_cross_check_trusts_up_to_the_first_disagreement() -> None:
    """Two runs differ in a column; the third sides with the second up to its own difference."""
    from rigidpend.experiments.bench.measuring.methods.cross_checks import compared

    task, _ = given("codes")
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
    assert asked[2] == task.theta2_0[1:2]
    assert found.certain[:, 0].all()
    assert found.certain[:, 1].tolist() == [True, True, False]
    assert found.codes[:, 1].tolist() == [0, 0, 1]


@pytest.mark.parametrize("method", ["aligned_batch", "scipy_dop853", "lie_poisson"])
@pytest.mark.parametrize("problem", ["free_body", "pendulum"])
def test_a_tighter_knob_is_more_exact(problem: str, method: str) -> None:
    knobs = [12, 48] if METHODS[method].knob == "steps" else [1e-3, 1e-7]
    error = problems.module(problem).error
    loose, tight = (
        error(answered(problem, method, knob), given(problem)[1])["error"] for knob in knobs
    )
    assert tight < loose / 50


def test_the_truth_of_the_free_body_is_its_elliptic_functions() -> None:
    task, reference = given("free_body")
    body, end = task.body, time_unit(task.body) * task.end
    J2 = time_unit(body) * np.linalg.norm(task.states[:3], axis=0)
    for column, (begin, truth) in enumerate(zip(task.states.T, reference["states"].T, strict=True)):
        # Exchanging M1 with M2 and alpha0 with pi - alpha0 takes an orbit around M2 to one
        # around M1.
        order = [0, 1, 2] if column % 2 else [1, 0, 2]
        half = (body.alpha0 if column % 2 else np.pi - body.alpha0) / 2
        first, second, third = begin[order] / np.linalg.norm(begin[:3])
        side = np.sign(second)
        height = np.hypot(first / np.sin(half), third)
        # The rate of the angle of `around_M2` is that of an amplitude.
        dn0 = np.sqrt(1 - (height * np.sin(half)) ** 2)
        k = height * np.cos(half) / dn0
        start = ellipkinc(np.arctan2(side * third, first / np.sin(half)), k * k)
        sn, cn, dn, _ = ellipj(start + np.sin(half) * J2[column] * dn0 * end, k * k)
        found = [np.sin(half) * height * cn, side * dn0 * dn, side * height * sn]
        expected = truth[order] / np.linalg.norm(truth[:3])
        np.testing.assert_allclose(found, expected, atol=1e-12)


def test_the_closed_form_of_the_free_body_is_the_truth_to_rounding() -> None:
    """M by Jacobi's functions and gamma by Legendre's third integral, against 113 bits."""
    task, reference = given("free_body")
    found = answered("free_body", "closed_form", None)
    np.testing.assert_allclose(found[:3] / 2, reference["states"][:3] / 2, rtol=0, atol=2e-15)
    # The angle of the radius errs by up to 2 ulp of the radians that it turned.
    turned = np.linalg.norm(task.states[:3, 0]) * task.end / float(task.body.A[2])
    atol = 4 * 2**-52 * (1 + turned)
    np.testing.assert_allclose(found[3:], reference["states"][3:], rtol=0, atol=atol)


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


@pytest.mark.parametrize("problem", NAMES)
def test_the_default_is_a_method_or_is_to_come(problem: str) -> None:
    assert problems.module(problem).DEFAULT in METHODS
    assert problems.module(problem).KIND in ("motion", "routes", "angle", "long")


def test_a_flow_can_start_again() -> None:
    task, _ = given("free_body")
    for name in ("aligned_batch", "scipy_lsoda", "lie_poisson", "heyoka_eq1"):
        method = METHODS[name]
        answer, setting = method.answer("free_body", "motion"), method.variants[0]
        assert answer is not None
        flow = methods.function(answer, 1, setting)(task, 16 if name == "lie_poisson" else 1e-8)
        ends = []
        for _ in range(2):
            flow.start()
            np.testing.assert_allclose(flow.states(), task.states, atol=1e-14)
            flow.to(task.end)
            ends.append(flow.states())
        np.testing.assert_array_equal(*ends)


def test_the_start_in_principal_axes_is_that_of_the_aligned_components() -> None:
    codes = problems.module("codes")
    task = codes.task(SMALL)
    expected = states_double(start(task.problem, 53, Scales()), np.array([0.0, 0.1, 0.2]), 0.0)
    body = codes.BODY
    found = aligned_from_body(task.states[:3], task.states[3:], body.alpha0, time_unit(body))
    np.testing.assert_allclose(np.stack(found), expected, atol=1e-15)
    random = codes.random_task(4, 3)
    from rigidpend.numbers.exact import exact

    one_by_one = initial(random.problem, [exact(float(x)) for x in random.theta2_0])
    np.testing.assert_allclose(random.states, np.array(one_by_one, dtype=float).T, atol=2e-16)


def test_the_field_with_angles_is_that_of_the_aligned_components() -> None:
    state = np.array([0.5, 0.4, 1.2, 0.48, 0.6, 0.64])
    s = time_unit(GENERIC)
    aligned = [*aligned_from_body(state[:3], state[3:], GENERIC.alpha0, s), 0.1, 0.2]
    expected = s * np.array(aligned_with_angles(GENERIC)(aligned, np)[6:], dtype=float)
    found = fields.of_body(GENERIC, angles=True)([*state, 0.1, 0.2])[6:]
    np.testing.assert_allclose(found, expected, rtol=1e-13)


def test_a_library_that_is_not_there_is_named() -> None:
    lacking = METHODS["diffrax"]._replace(libraries=("json", "no_such_library"))
    assert lacking.absent() == "no_such_library"
    assert METHODS["lie_poisson"].absent() == ""
