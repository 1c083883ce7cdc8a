"""Every method finds the symbols of Fig. 4, and crossing times to what its knob promises."""

import functools
import gc
import multiprocessing
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.bench import problems
from rigidpend.experiments.bench.methods import METHODS, Entrant
from rigidpend.experiments.bench.peers import Solver, compared, ready
from rigidpend.experiments.bench.problems import Crossed, Task, time_unit
from rigidpend.experiments.principal_axes import initial
from rigidpend.numbers.exact import exact
from rigidpend.routes.start import Scales, start, states_double
from tests.orbits.integrate.problems import FIG4, needs_heyoka
from tests.strategies import aligned_from_body

pytestmark = needs_heyoka("the references in 113 bits")
CASES = [
    *((name, {}, 1) for name in METHODS),
    ("heyoka_principal", {"parameters": True}, 2),
    ("route_codes", {"way": "auto"}, 1),
]
"""Methods, what is set otherwise, and numbers of threads."""
TOLERANCE = 1e-11
"""A tolerance that should be good enough."""


@functools.cache
def given() -> tuple[Task, Any]:
    task = problems.fig4(3, 3)
    return task, problems.truth(task)


def errors_of(name: str, other: Any, threads: int) -> dict[str, Any]:
    method, (task, truth) = METHODS[name], given()
    entry = Entrant(None if method.finest is None else TOLERANCE, method.variants[0] | other)
    if method.family == "heyoka":
        # Of three orbits one comes after others; fewer lanes are compiled sooner.
        entry.setting["lanes"] = 2
    solver = ready(name, task, entry, threads)
    first, again = (solver.read(solver.solve()) for _ in range(2))
    np.testing.assert_array_equal(first.crossing_time, again.crossing_time, "it begins anew")
    undecided = 0 if first.certain is None else int((~first.certain).sum())
    return {**problems.errors(first, truth), "undecided": undecided}


@pytest.fixture(scope="module")
def apart() -> Iterator[Executor]:
    """A process of its own: the memory of many compilers would slow the forks of this one.

    What is compiled for three orbits need not be fast, nor is there garbage worth a look.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NUMBA_OPT", "0")
        with ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), gc.disable) as process:
            yield process


@pytest.mark.slow
@pytest.mark.parametrize(("name", "other", "threads"), CASES)
def test_agrees_with_the_truth(apart: Executor, name: str, other: Any, threads: int) -> None:
    for library in METHODS[name].libraries:
        pytest.importorskip(library)
    errors = apart.submit(errors_of, name, other, threads).result()
    assert errors.pop("error") < 1e-3
    assert errors == {"wrong_symbols": 0, "undecided": 0}


@pytest.mark.slow
def test_a_problem_that_is_asked_for_often_has_its_maps() -> None:
    entry = Entrant(None, METHODS["route_codes_often"].variants[0])
    solver = ready("route_codes_often", problems.fig4(63, 15), entry)
    assert solver.solve().by_map.all()


def test_a_cross_check_trusts_up_to_the_first_disagreement() -> None:
    """Two runs differ in a column; the third sides with the second up to its own difference."""
    task = problems.fig4(3, 3)
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


def test_the_start_in_principal_axes_is_that_of_the_aligned_components() -> None:
    task, body = problems.fig4(3, 3), FIG4
    expected = states_double(start(task.problem, 53, Scales()), np.array([0.0, 0.1, 0.2]), 0.0)
    found = aligned_from_body(task.states[:3], task.states[3:], body.alpha0, time_unit(body))
    np.testing.assert_allclose(np.stack(found), expected, atol=1e-15)
    random = problems.random_routes(task.problem, 4)
    one_by_one = initial(random.problem, [exact(float(x)) for x in random.theta2_0])
    np.testing.assert_allclose(random.states, np.array(one_by_one, dtype=float).T, atol=2e-16)
