"""Cells of a plane: the codes of each orbit alone, whatever shares it and whatever decides it."""

import math
import pickle
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend import route_codes
from rigidpend.machine.workers import side_by_side
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.routes import cells, certainty, choice, costs
from rigidpend.routes.cells import Cells, actions, cell_problem, cells_of_each, cells_of_starts
from rigidpend.routes.problem import passage_limit, phase_rate
from tests.bodies import problem
from tests.orbits.integrate.problems import FIG4, same

N = 4
PROBLEM = problem(n_symbols=N)
STARTS = np.array([1e-9, 1e-7, 1e-5])
THETA2, J1_0 = np.random.default_rng(4).uniform(0, 6.28, 60), np.tile(STARTS, 20)
DOUBLES = resolve(None, None, (53,))
MU, H0 = np.array([1e-3, 2e-3, 1e-3, 2e-3, 1e-3]), np.array([1.1, 1.2, 1.9, 1.3, 1.4])
ALPHA0 = np.array([1.9, 1.9, 1.5, 1.9, 1.9])
FEW = np.array([0.3, 1.2, 2.2, 3.1, 5.0])


def of_starts(monkeypatch: pytest.MonkeyPatch, many: bool, jobs: int = 1) -> Cells:
    monkeypatch.setattr(costs, "LEAST_SECONDS", 0.0 if many else math.inf)
    monkeypatch.setattr(costs, "budget", lambda *_: math.inf)
    given = PROBLEM, THETA2, J1_0, resolve(None, None, (53, 64)), jobs
    return cells_of_starts(*given, ends=(1e-10, 1e-4), orbits=1000)


@pytest.mark.parametrize("many", [True, False])
def test_codes_are_those_of_each_start_alone(many: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(choice, "PIECE", 16)
    found = of_starts(monkeypatch, many)
    assert same(found, of_starts(monkeypatch, many, jobs=3))
    assert (found.by_map.mean() > 0.9) == many
    assert (found.certain == N).mean() > 0.99
    for J1 in STARTS:
        here = J1_0 == J1
        alone = route_codes(FIG4, THETA2[here], h0="1.3342", J1_0=float(J1), n_symbols=N)
        known = np.arange(N)[:, None] < found.certain[here]
        assert (alone.codes == found.codes[:, here])[known & alone.certain].all()


def test_orbits_without_actions_have_that_of_the_problem(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(choice, "decide", decided := Mock(wraps=choice.decide))
    found = cells_of_starts(PROBLEM, FEW, None, DOUBLES, orbits=1000)
    assert decided.call_args.args[0].orbits == 1000
    alone = route_codes(FIG4, FEW, h0="1.3342", J1_0="1e-8", n_symbols=N)
    assert (found.certain == N).all()
    assert (alone.codes == found.codes).all()
    # In any order of the actions the largest is the problem's, and the least waits longest.
    cells_of_starts(PROBLEM, FEW[:3], STARTS[[1, 2, 0]], DOUBLES)
    run = decided.call_args.args[0]
    ends = run.problem.J1_0, run.starts.least_problem.J1_0
    assert [float(x) for x in ends] == [STARTS[2], STARTS[0]]
    # A part of a plane has the ends of all of it, and is decided as all of it would be.
    decided.side_effect = InterruptedError
    with pytest.raises(InterruptedError):
        cells_of_starts(PROBLEM, FEW[:3], STARTS, DOUBLES, ends=(1e-10, 1e-4), orbits=1000)
    run = decided.call_args.args[0]
    ends = run.problem.J1_0, run.starts.least_problem.J1_0
    assert (run.orbits, [float(x) for x in ends]) == (1000, [1e-4, 1e-10])


def test_a_piece_has_as_many_passages_as_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(certainty, "side_by_side", beside := Mock(wraps=side_by_side))
    for passages, most in ((7 * (N + 1), 7), (N, 1)):
        beside.reset_mock()
        monkeypatch.setattr(choice, "PIECE", passages)
        of_starts(monkeypatch, many=True)
        # The first are those of the maps.
        assert max(map(len, beside.call_args_list[0].args[3])) == most


@pytest.mark.parametrize("jobs", [1, 2])
def test_mixed_orbits_have_their_own_codes(jobs: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def sent(work: Any, given: Any, python: bool, parts: Any, count: int) -> Any:
        """As to processes, but without waiting for one to start."""
        assert (python, count) == (True, jobs)
        return [work(part, *given) for part in pickle.loads(pickle.dumps(parts))]

    monkeypatch.setattr("rigidpend.routes.cells.side_by_side", sent)
    values = {"mu": MU, "h0": H0, "alpha0": ALPHA0}
    found = cells_of_each(PROBLEM, values, FEW, DOUBLES, jobs)
    assert (found.certain == N).all()
    assert not found.by_map.any()
    for k, h0 in enumerate(H0.tolist()):
        one = cell_problem(PROBLEM, {name: float(x[k]) for name, x in values.items()})
        alone = route_codes(one.body, [FEW[k]], h0=h0, J1_0="1e-8", n_symbols=N)
        assert (alone.codes[:, 0] == found.codes[:, k]).all()


def test_the_fastest_rate_and_longest_wait_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(choice, "decide", decided := Mock(wraps=choice.decide))
    cells_of_each(PROBLEM, {"h0": H0}, FEW, DOUBLES)
    each = [cell_problem(PROBLEM, {"h0": h0}) for h0 in H0.tolist()]
    run, _ = decided.call_args.args
    assert run.rate == max(map(phase_rate, each))
    assert passage_limit(run.problem, 53) == max(passage_limit(one, 53) for one in each)


def test_rows_replace_one_value_and_no_other() -> None:
    assert float(cell_problem(PROBLEM, {"log10_J1_0": -7.0}).J1_0) == 10.0**-7.0
    logarithms = np.linspace(-12, -3, 500)
    each = [float(cell_problem(PROBLEM, {"log10_J1_0": x}).J1_0) for x in logarithms]
    assert actions(logarithms).tolist() == each
    assert cell_problem(PROBLEM, {"h0": 1.5}).h0 == exact(1.5)
    assert float(cell_problem(PROBLEM, {"mu": 0.002}).body.mu) == 0.002
    turned = cell_problem(PROBLEM, {"beta0": 1.0}).body
    assert float(turned.beta0) == pytest.approx(1.0, rel=1e-15, abs=0)
    assert turned.A == FIG4.A
    wider = cell_problem(PROBLEM, {"alpha0": 1.8}).body
    assert float(wider.alpha0) == pytest.approx(1.8, rel=1e-15, abs=0)
    assert (wider.A[:2], wider.r, wider.mu) == (FIG4.A[:2], FIG4.r, FIG4.mu)
    assert set(cells.AXES) == {"log10_J1_0", "mu", "h0", "beta0", "alpha0"}
