"""Cells of a plane: the codes of each orbit alone, whatever shares it and whatever decides it."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rigidpend import Body, route_codes
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.routes import certainty, choice, costs
from rigidpend.routes.cells import AXES, Cells, cell_problem, cells_of_each, cells_of_starts
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import passage_limit, phase_rate
from rigidpend.routes.run import Run, Starts, in_pieces
from tests.bodies import problem
from tests.orbits.integrate.problems import FIG4, same

N = 4
PROBLEM = problem(n_symbols=N)
STARTS = np.array([1e-9, 1e-7, 1e-5])
THETA2, J1_0 = np.random.default_rng(4).uniform(0, 6.28, 60), np.tile(STARTS, 20)
DOUBLES = resolve(None, None, (53,))
MU, H0 = np.array([1e-3, 2e-3, 1e-3, 2e-3, 1e-3]), np.array([1.1, 1.2, 1.9, 1.3, 1.4])
FEW = np.array([0.3, 1.2, 2.2, 3.1, 5.0])


def of_starts(monkeypatch: Any, many: bool, **more: Any) -> Cells:
    monkeypatch.setattr(costs, "LEAST", 0.0 if many else math.inf)
    monkeypatch.setattr(costs, "budget", lambda *_: math.inf)
    arithmetic = resolve(None, None, more.pop("precisions", (53, 64)))
    given = PROBLEM, THETA2, J1_0, arithmetic
    return cells_of_starts(*given, ends=(1e-10, 1e-4), orbits=1000, **more)


@pytest.mark.parametrize("many", [True, False])
def test_agrees_the_codes_with_those_of_each_start_alone(
    many: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = of_starts(monkeypatch, many)
    assert (found.by_map.mean() > 0.9) == many
    assert (found.certain == N).mean() > 0.99
    for J1 in STARTS:
        here = J1_0 == J1
        alone = route_codes(FIG4, THETA2[here], h0="1.3342", J1_0=float(J1), n_symbols=N)
        known = np.arange(N)[:, None] < found.certain[here]
        assert (alone.codes == found.codes[:, here])[known & alone.certain].all()


@pytest.mark.parametrize("many", [True, False])
def test_no_result_depends_on_the_jobs(many: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(choice, "PIECE", 16)
    assert same(*(of_starts(monkeypatch, many, jobs=jobs) for jobs in (1, 3)))


def test_a_piece_has_no_more_passages_than_memory_is_meant_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    taken = list[int]()

    def watched(work: Any, columns: Any, size: int, jobs: int) -> Any:
        taken.append(size)
        return in_pieces(work, columns, size, jobs)

    monkeypatch.setattr(choice, "in_pieces", watched)
    for passages in (7 * (N + 1), N):
        monkeypatch.setattr(choice, "PIECE", passages)
        of_starts(monkeypatch, many=True)
    assert {*taken} == {7, 1}


def test_the_least_start_says_how_long_to_wait_and_the_largest_is_asked_of_maps() -> None:
    least = replace(PROBLEM, J1_0=exact(1e-30))
    run = Run(PROBLEM, Phases(FEW), DOUBLES, starts=Starts(np.full(5, 1e-30), least))
    deep = Run(least, Phases(FEW), DOUBLES)
    assert same(*(each.crossings(53, certainty.FIRST, np.arange(5)) for each in (run, deep)))


@pytest.mark.parametrize("jobs", [1, 2])
def test_orbits_of_mixed_bodies_and_energies_have_their_own_codes(
    jobs: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def sent(work: Any, given: Any, python: bool, parts: Any, count: int) -> Any:
        """As to processes, but without waiting for one to start."""
        assert (python, count) == (True, jobs)
        return [work(part, *given) for part in pickle.loads(pickle.dumps(parts))]

    monkeypatch.setattr("rigidpend.routes.cells.side_by_side", sent)
    found = cells_of_each(PROBLEM, {"mu": MU, "h0": H0}, FEW, DOUBLES, jobs)
    assert (found.certain == N).all()
    assert not found.by_map.any()
    for k, (mu, h0) in enumerate(zip(MU.tolist(), H0.tolist(), strict=True)):
        body = Body((2, 1, "1.5"), (1, 1, 0), mu)
        alone = route_codes(body, [FEW[k]], h0=h0, J1_0="1e-8", n_symbols=N)
        assert (alone.codes[:, 0] == found.codes[:, k]).all()


def test_agreement_is_held_against_the_fastest_and_the_wait_is_the_longest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[tuple[float, float]] = []
    real = Run.decided

    def noted(run: Run) -> Any:
        asked.append((run.rate, passage_limit(run.problem, 53)))
        return real(run)

    monkeypatch.setattr(Run, "decided", noted)
    cells_of_each(PROBLEM, {"h0": H0}, FEW, DOUBLES)
    each = [cell_problem(PROBLEM, {"h0": h0}) for h0 in H0.tolist()]
    rates, waits = map(phase_rate, each), (passage_limit(problem, 53) for problem in each)
    assert asked == [(max(rates), max(waits))]


def test_rows_replace_one_value_and_no_other() -> None:
    assert float(cell_problem(PROBLEM, {"log10_J1_0": -7.0}).J1_0) == 10.0**-7.0
    assert cell_problem(PROBLEM, {"h0": 1.5}).h0 == exact(1.5)
    assert float(cell_problem(PROBLEM, {"mu": 0.002}).body.mu) == 0.002
    turned = cell_problem(PROBLEM, {"beta0": 1.0}).body
    assert float(turned.beta0) == pytest.approx(1.0, rel=1e-15)
    assert turned.A == FIG4.A
    wider = cell_problem(PROBLEM, {"alpha0": 1.8}).body
    assert float(wider.alpha0) == pytest.approx(1.8, rel=1e-15)
    assert (wider.A[:2], wider.r, wider.mu) == (FIG4.A[:2], FIG4.r, FIG4.mu)
    assert set(AXES) == {"log10_J1_0", "mu", "h0", "beta0", "alpha0"}
