"""Precisions by which the orbits of a run climb, and what is computed side by side."""

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate import no_crossings
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.integrate.kernel.taylor_step import order_of
from rigidpend.routes import certainty
from rigidpend.routes.certainty import FIRST_SCALES, SECOND_SCALES, THIRD_SCALES
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem, passage_limit
from rigidpend.routes.run import Run, Starts, abreast, tolerance_of
from rigidpend.routes.start import Scales
from tests.bodies import problem

EVERY = FIRST_SCALES, SECOND_SCALES, THIRD_SCALES
GENTLE = problem()
DEEP = problem(
    Body(("1.965", "0.689", "1.942"), ("0.610", "0.792", 0), "0.0198"), h0="1.1", J1_0="1.2e-8"
)
"""Drawn by lot: two orbits in three are beyond doubles."""


def run(*precisions: int, engine: str = "taylor", problem: RouteProblem = DEEP, n: int = 24) -> Run:
    return Run(problem, Phases(np.linspace(0, 6.2, n)), resolve(engine, None, precisions), jobs=2)


@pytest.mark.parametrize(
    ("precisions", "known", "expected"),
    [
        ((53, 106, 160), 53, (64, 76, 88, 106, 109, 120, 131, 160)),
        ((53, 106, 160), 75, (88, 106, 109, 120, 131, 160)),
        ((53, 106, 160), 88, (106, 109, 120, 131, 160)),
        ((53, 113), 53, (64, 76, 88, 113)),
        # At least eight bits from all that are asked for or known.
        ((53, 72), 53, (64, 72)),
        ((53, 71), 53, (71,)),
        ((53, 106), 68, (76, 88, 106)),
        ((53, 106), 69, (88, 106)),
        ((53, 64), 53, (64,)),
        ((53,), 53, ()),
        ((106, 160), 106, (109, 120, 131, 160)),
    ],
)
def test_rungs_stand_between_precisions_and_far_from_all(
    precisions: tuple[int, ...], known: int, expected: tuple[int, ...]
) -> None:
    assert run(*precisions).beyond(known) == expected


def test_engines_whose_further_bits_are_integers_have_no_rungs() -> None:
    assert run(53, 106, 160, engine="scipy").beyond(53) == (106, 160)


@pytest.mark.parametrize("bits", [53, 88, 106])
def test_computations_that_confirm_have_series_of_another_order(bits: int) -> None:
    """Those of one order would err alike."""
    tolerances = (tolerance_of(run(53, 106).arithmetic, bits, scales) for scales in EVERY)
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


@pytest.mark.parametrize(("bits", "scales"), list(zip((53, 53, 106), EVERY, strict=True)))
def test_orbits_wait_as_long_as_the_one_that_starts_closest(
    bits: int, scales: Scales, integrations: list[dict[str, Any]]
) -> None:
    """In t', whatever the unit of the computation; in more bits orbits come closer."""
    least = replace(GENTLE, J1_0=exact("1e-12"))
    means = replace(
        run(53, 106, problem=GENTLE, n=2), starts=Starts(np.array([1e-8, 1e-12]), least)
    )
    means.crossings(bits, scales, np.arange(2))
    [made] = integrations
    assert made["limit"] * scales.time_unit == pytest.approx(passage_limit(least, bits))


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
    precisions: tuple[int, ...],
    bits: int,
    n: int,
    jobs: int,
    begun: list[bool],
    monkeypatch: pytest.MonkeyPatch,
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
    ("bits", "n", "one_piece"),
    [
        *((53, n, True) for n in (8, 17, 256)),
        *((53, n, False) for n in (9, 16, 257)),
        (106, 8, True),
        (106, 9, False),
    ],
)
def test_columns_that_are_one_piece_take_two_computations_at_once(
    bits: int, n: int, one_piece: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With two threads 9 to 16 columns in doubles are two pieces, one for each thread."""
    shared: list[Any] = []

    def noted(work: Any, given: Any, python: bool, parts: Any, jobs: int) -> Any:
        shared.append(parts)
        return [work(part, *given) for part in parts]

    means = run(bits, problem=GENTLE, n=n)
    for room in ("run", "certainty"):
        monkeypatch.setattr(f"rigidpend.routes.{room}.side_by_side", noted)
    monkeypatch.setattr(Run, "crossings", lambda *given: no_crossings(16, len(given[-1])))
    monkeypatch.setattr(certainty, "agreement", lambda a, *_: a.separatrix[1:] == 0)
    means.by_integration()
    pieces, *computations = shared
    assert len(pieces) == (1 if one_piece else 2)
    assert computations == ([(FIRST_SCALES, SECOND_SCALES)] if one_piece else [])
