"""Precisions by which the orbits of a run climb, and what is computed side by side."""

import pickle
from dataclasses import replace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.integrate.kernel.taylor_step import order_of
from rigidpend.routes import certainty
from rigidpend.routes.certainty import FIRST_SCALES, SCALES, SECOND_SCALES
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem, passage_limit
from rigidpend.routes.run import Run, Starts, abreast, tolerance_of
from rigidpend.routes.start import Scales
from tests.bodies import problem

GENTLE = problem()
DEEP = problem(
    Body(("1.965", "0.689", "1.942"), ("0.610", "0.792", 0), "0.0198"), h0="1.1", J1_0="1.2e-8"
)
"""Drawn by lot: two orbits in three are beyond doubles."""


def run(*precisions: int, engine: str = "taylor", problem: RouteProblem = DEEP, n: int = 24) -> Run:
    return Run(problem, Phases(np.linspace(0, 6.2, n)), resolve(engine, None, precisions), jobs=2)


@pytest.mark.parametrize("bits", [53, 88, 106])
def test_computations_that_confirm_have_series_of_another_order(bits: int) -> None:
    """Those of one order would err alike."""
    tolerances = (tolerance_of(run(53, 106).arithmetic, bits, scales) for scales in SCALES)
    first, *others = (order_of(x * 2.0 ** (53 - bits)) for x in tolerances)
    assert min(others) > first


def test_a_rung_is_computed_once_and_decides(integrations: list[dict[str, Any]]) -> None:
    found = run(53, 106).by_integration()
    finer = {bits: [x["orbits"] for x in integrations if x["bits"] == bits] for bits in (64, 76)}
    assert found.certain.all()
    assert {64, 76} <= set(found.bits.tolist())
    for bits, orbits in finer.items():
        # Each orbit that is open below it comes once.
        assert sum(orbits) == (found.bits >= bits).sum()


@pytest.mark.parametrize(("bits", "scales"), list(zip((53, 53, 106), SCALES, strict=True)))
def test_orbits_wait_as_long_as_the_one_that_starts_closest(
    bits: int, scales: Scales, integrations: list[dict[str, Any]]
) -> None:
    """In t', whatever the unit of the computation, and in doubles as long as in most bits."""
    least = replace(GENTLE, J1_0=exact("1e-12"))
    means = replace(
        run(53, 106, problem=GENTLE, n=2), starts=Starts(np.array([1e-8, 1e-12]), least)
    )
    means.crossings(bits, scales, np.arange(2))
    [made] = integrations
    assert made["limit"] * scales.time_unit == pytest.approx(passage_limit(least, 106))


def test_few_orbits_take_both_computations_at_once(integrations: list[dict[str, Any]]) -> None:
    means, few = run(53, 106, problem=GENTLE), np.array([1, 4, 7])
    expected = means.crossings(106, SECOND_SCALES, few[1:])
    integrations.clear()
    compute = abreast(means)
    compute(106, FIRST_SCALES, few)
    second = compute(106, SECOND_SCALES, few[1:])
    assert [x["orbits"] for x in integrations] == [3, 3]
    for got, known in zip(second, expected, strict=True):
        np.testing.assert_array_equal(got, known)


@pytest.mark.parametrize(
    ("precisions", "bits", "n", "jobs", "begun"),
    [
        ((53, 106), 106, 3, 2, [False]),
        ((53, 106), 106, 3, 1, []),
        ((53, 106), 106, 17, 2, []),
        # On a rung there is no second one.
        ((53, 106), 64, 3, 2, []),
        # Processes begin for what is made in any case: in the first precision, of one orbit.
        ((500,), 500, 1, 2, [True]),
        ((53, 500), 500, 1, 2, []),
        ((500,), 500, 2, 2, []),
    ],
)
def test_where_two_computations_go_side_by_side_in_threads_or_processes(
    precisions: Any, bits: int, n: int, jobs: int, begun: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[bool] = []

    def noted(work: Any, given: Any, python: bool, scales: Any, count: int) -> Any:
        seen.append(python)
        assert (scales, count) == ((FIRST_SCALES, SECOND_SCALES), 2)
        assert pickle.loads(pickle.dumps((work, given)))
        return None, None

    monkeypatch.setattr("rigidpend.routes.run.side_by_side", noted)
    monkeypatch.setattr(Run, "crossings", lambda *_: None)
    abreast(replace(run(*precisions), jobs=jobs))(bits, FIRST_SCALES, np.arange(n))
    assert seen == begun


@pytest.mark.parametrize(
    ("orbits", "bits", "columns", "pieces", "jobs"),
    [
        # In doubles so many that a piece is worth it, but for so few that threads would be idle;
        (8, 53, 8, [8], None),
        (9, 53, 9, [8, 1], 1),
        (16, 53, 16, [8, 8], 1),
        (17, 53, 17, [17], None),
        (256, 53, 600, [256, 256, 88], None),
        (257, 53, 600, [256, 256, 88], 1),
        # eight for each thread, and never more than 1,024;
        (24, 53, 4800, [300] * 16, None),
        (24, 53, 17000, [1024] * 16 + [616], None),
        # in more bits a vector is a piece; and integers are shared out in each computation.
        (8, 106, 17, [8, 8, 1], None),
        (9, 106, 0, [], 1),
        (9, 500, 17, [17], 2),
    ],
)
def test_threads_share_orbits_in_pieces(
    orbits: int, bits: int, columns: int, pieces: Any, jobs: int | None, monkeypatch: Any
) -> None:
    """A piece has one thread; of a single one two computations are abreast, integers have all."""
    asked = list[int]()
    monkeypatch.setattr(certainty, "decide", decided := Mock())
    monkeypatch.setattr("rigidpend.routes.run.abreast", lambda _: lambda *given: None)
    monkeypatch.setattr(Run, "crossings", lambda self, *given: asked.append(self.jobs))
    run(bits, n=orbits).by_integration()
    compute, *_, division = decided.call_args.args
    size, threads = division(columns, bits)
    assert [min(size, columns - k) for k in range(0, columns, size)] == pieces
    assert threads == (1 if bits == 500 else 2)
    compute(bits, FIRST_SCALES, np.arange(orbits))
    assert asked == ([jobs] if jobs else [])


def test_doubles_begin_at_the_phases_and_not_at_their_doubles() -> None:
    """At 1e6 these are 1e-10 apart."""
    means = replace(run(53), phases=Phases(["1000000 + 1/3", "1000000 + 1/7"]))
    (_, rough), (_, fine) = (means.begin(bits, FIRST_SCALES, np.arange(2)) for bits in (53, 200))
    np.testing.assert_allclose(rough, fine.astype(float), rtol=0, atol=4e-16)
