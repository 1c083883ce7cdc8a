"""Planes of route codes: the codes of each orbit alone, whatever decides them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from rigidpend import route_codes
from rigidpend.mechanics.body import BodyError
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.return_map import MapError
from rigidpend.routes import mapped, plane
from rigidpend.routes.plane import Cells, Plane
from rigidpend.routes.problem import ProblemError, RouteProblem
from rigidpend.routes.rows import AXES, cell_problem
from tests.orbits.integrate.problems import FIG4

N = 6
STARTS = np.array([1e-9, 1e-7, 1e-5])
RANDOM = np.random.default_rng(4)
THETA2, J1_0 = RANDOM.uniform(0, 6.28, 60), np.repeat(STARTS, 20)


def made(monkeypatch: Any, many: bool, **more: Any) -> Cells:
    monkeypatch.setattr(plane, "MANY", 1 if many else 10**9)
    monkeypatch.setattr(mapped, "budget", lambda *_: math.inf)
    arithmetic = resolve(None, None, more.pop("precisions", (53, 64)))
    ends = 1e-10, 1e-4
    return Plane(FIG4, "1.3342", ends, N, arithmetic, 1000, **more).cells(THETA2, J1_0)


@pytest.mark.parametrize("many", [True, False])
def test_agrees_the_codes_with_those_of_each_start_alone(
    many: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = made(monkeypatch, many)
    assert (found.by_map.mean() > 0.9) == many
    assert (found.certain == N).mean() > 0.99
    for J1 in STARTS:
        here = J1_0 == J1
        alone = route_codes(FIG4, THETA2[here], h0="1.3342", J1_0=float(J1), n_symbols=N)
        known = np.arange(N)[:, None] < found.certain[here]
        assert (alone.codes == found.codes[:, here])[known & alone.certain].all()


@pytest.mark.parametrize("many", [True, False])
def test_no_result_depends_on_the_jobs(many: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rigidpend.routes.codes.PIECE", 16)
    one, three = (made(monkeypatch, many, jobs=jobs) for jobs in (1, 3))
    for a, b in zip(one, three, strict=True):
        assert np.array_equal(a, b)


def test_only_the_sample_and_what_stays_open_is_integrated(
    integrations: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mapped, "LEAST_SAMPLE", 4)
    monkeypatch.setattr(mapped, "THIRDS", 0)
    found = made(monkeypatch, True)
    left = int((~found.by_map).sum())
    assert sum(x["orbits"] for x in integrations) <= 4 * (4 + left)


def test_orbits_without_a_map_are_integrated(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: Any, **__: Any) -> Any:
        raise MapError("none")

    monkeypatch.setattr(mapped, "return_map", none)
    assert not made(monkeypatch, True, precisions=(53,)).by_map.any()


def test_rows_replace_one_value_and_no_other() -> None:
    problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 3)
    assert float(cell_problem(problem, {"log10_J1_0": -7.0}).J1_0) == 10.0**-7.0
    assert cell_problem(problem, {"h0": 1.5}).h0 == exact(1.5)
    assert float(cell_problem(problem, {"mu": 0.002}).body.mu) == 0.002
    turned = cell_problem(problem, {"beta0": 1.0}).body
    assert float(turned.beta0) == pytest.approx(1.0, rel=1e-15)
    assert turned.A == FIG4.A
    wider = cell_problem(problem, {"alpha0": 1.8}).body
    assert float(wider.alpha0) == pytest.approx(1.8, rel=1e-15)
    assert (wider.A[:2], wider.r, wider.mu) == (FIG4.A[:2], FIG4.r, FIG4.mu)
    assert set(AXES) == {"log10_J1_0", "mu", "h0", "beta0", "alpha0"}


@pytest.mark.parametrize(
    ("axis", "value", "error"),
    [
        ("h0", 1e-4, ProblemError),
        ("log10_J1_0", 1.0, ProblemError),
        ("beta0", 4.0, BodyError),
        ("alpha0", 3.5, BodyError),
    ],
)
def test_rows_that_the_problem_excludes_are_refused(axis: str, value: float, error: Any) -> None:
    problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 3)
    with pytest.raises(error):
        cell_problem(problem, {axis: value})
