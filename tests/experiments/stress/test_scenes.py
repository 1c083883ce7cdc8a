"""Verdicts follow from value and bound; the truth is the truth; starts are where they say."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend.experiments.stress import FAILED, LIMIT, PASSED, compute, draw, scenes
from rigidpend.experiments.stress.extremes import PLACES
from rigidpend.experiments.stress.scenes import Claim, Trial
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, canonical_from_aligned
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate import Crossings
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.routes.certainty import FIRST
from rigidpend.routes.problem import ProblemError, RouteProblem
from rigidpend.routes.run import Run
from tests.experiments.stress.verdicts import verdicts
from tests.experiments.trees import from_file
from tests.orbits.integrate.problems import FIG4

PROBLEM = RouteProblem(FIG4, exact("1.3342"), exact("1e-6"), 1)


def claim(name: str, bound: float, up_to: float = -math.inf) -> Claim:
    return Claim(name, bound, "what is measured", "the reason", "rad", "known why", up_to)


def trial(claims: list[Claim], *values: float) -> Trial:
    return Trial("some_group", "t", claims, lambda: (values, {}))


@pytest.mark.parametrize(
    ("value", "bound", "up_to", "verdict", "ratio"),
    [
        (1.0, 2.0, -math.inf, PASSED, 0.5),
        (2.0, 2.0, -math.inf, PASSED, 1.0),
        (3.0, 2.0, -math.inf, FAILED, 1.5),
        (3.0, 2.0, 3.0, LIMIT, 1.5),
        (3.1, 2.0, 3.0, FAILED, 1.55),
        (0.0, 0.0, -math.inf, PASSED, 0.0),
        (1.0, 0.0, -math.inf, FAILED, math.inf),
        (math.inf, 1.0, 3.0, FAILED, math.inf),
        (math.nan, 1.0, 9.0, FAILED, math.nan),
    ],
)
def test_verdict_and_ratio(
    value: float, bound: float, up_to: float, verdict: str, ratio: float
) -> None:
    told: Any = claim("a", bound, up_to).told(value, "")
    assert told["verdict"] == verdict
    assert told["ratio"] == pytest.approx(ratio, nan_ok=True)


@pytest.mark.parametrize("error", [ProblemError("J1_0", "no such orbit"), ArithmeticError("stuck")])
def test_a_refusal_refutes_every_claim_of_its_trial(error: Exception) -> None:
    claims = [claim("a", 1.0), claim("b", 1.0, 9.0)]
    made: Any = Trial("k", "t", claims, Mock(side_effect=error)).tried()
    assert verdicts(made) == {"a": FAILED, "b": FAILED}
    assert {x["note"] for x in made["claims"].values()} == {f"refused: {error}"}
    assert made["curves"] == {}


@pytest.mark.parametrize("claims", ["a", "abc"])
def test_a_claim_that_nothing_was_measured_of_and_one_not_declared_are_refused(claims: str) -> None:
    with pytest.raises(ValueError, match="zip"):
        trial([claim(name, 1.0) for name in claims], 0.5, 0.1).tried()


def test_tables_tell_what_was_stored(tmp_path: Path) -> None:
    claims = [claim("x", 2), claim("y", 2), claim("z", 2, 6)]
    made: Any = trial(claims, 1, math.inf, 5).tried()
    made["claims"]["y"]["note"] = "stuck"
    tree = {"some_group": {**made, "claims": compute.table(made["claims"])}}
    result = from_file(tmp_path, "stress", tree)
    [every] = draw.claims_tables(result)
    assert (every.caption, len(every.rows)) == ("some group", 3)
    assert every.rows[2] == ("z", "5", "2", "2.5", "rad", "limit")
    kinds, beyond = draw.tables(result)
    assert kinds.rows[0] == ("some group", "1", "1", "1", "0.5"), "part of what passed alone"
    assert beyond.rows == [
        ("FAILED", "some group, y", "what is measured; stuck; known why"),
        ("limit", "some group, z", "what is measured; known why"),
    ]
    passed: Any = trial(claims[:1], 1).tried()
    tree = {"some_group": {**passed, "claims": compute.table(passed["claims"])}}
    assert len(draw.tables(from_file(tmp_path, "stress", tree))) == 1


@pytest.mark.slow
def test_integers_agree_with_fours_of_doubles_in_113_bits() -> None:
    ours, integers = (
        scenes.route_crossings(PROBLEM, ["0.4"], 1, bits, engine)
        for engine, bits in (("taylor", 113), ("scipy", 160))
    )
    assert np.array_equal(ours.separatrix, integers.separatrix)
    assert np.abs(ours.time - integers.time).max() <= 1e-13


def test_phase_errors_count_another_separatrix_as_infinite() -> None:
    def record(times: list[float], beside: list[int]) -> Crossings:
        outcome = np.zeros(1, dtype=np.uint8)
        return Crossings(np.array([times]).T, np.array([beside], dtype=np.uint8).T, outcome)

    found = record([1.0, 2.5, np.nan, np.nan], [2, 1, 0, 0])
    true = record([1.25, 2.5, np.nan, 9.0], [2, 3, 0, 4])
    assert scenes.phase_errors(found, true, 2.0)[:, 0].tolist() == [0.5, np.inf, 0.0, np.inf]


@pytest.mark.parametrize("place", PLACES, ids=lambda x: x.name)
def test_places_are_where_they_say(place: scenes.Place) -> None:
    made = Aligned(*place.state(FIG4, 0.7))
    M, gamma = body_from_aligned(made, FIG4.alpha0, 1.0)
    back = canonical_from_aligned(made, FIG4.alpha0, FIG4.beta0)
    assert M @ gamma == pytest.approx(place.J3, abs=1e-14)
    assert float(back.J1) == pytest.approx(place.J1, rel=1e-12)
    assert float(back.J2mJ1) == pytest.approx(place.J2mJ1, rel=1e-12)
    large, small = (made.Qp, made.Qm) if place.separatrix in (2, 4) else (made.Qm, made.Qp)
    assert (small == 0) == (place.aside == 0)
    assert np.sign(large) == {1: -1, 2: 1, 3: 1, 4: -1}[place.separatrix]


def test_codes_and_truth_are_computed_as_they_are_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By that engine, to that tolerance, in those precisions, of all phases."""
    monkeypatch.setattr(Run, "crossings", lambda run, *given: (run, *given))
    made: Any = scenes.route_crossings(PROBLEM, ["0.4", "2.1"], 3, 160, "scipy")
    run, *given, columns = made
    asked_of = run.problem, run.arithmetic, run.jobs, run.phases.high.tolist()
    assert asked_of == (PROBLEM, resolve("scipy", None, (160,)), 3, [0.4, 2.1])
    assert (given, list(columns)) == ([160, FIRST], [0, 1])
    monkeypatch.setattr(scenes, "codes_of", lambda *given, kept: (*given, kept))
    asked = PROBLEM, ["0.4", "2.1"], 3, (53, 106), 1e-12, "integration", "scipy"
    expected = *asked[:2], resolve("scipy", 1e-12, (53, 106)), 3, "integration", True
    found: Any = scenes.routes(*asked)
    assert found == expected


def test_starts_have_the_energy_and_the_J3_that_are_asked_for() -> None:
    asked: Any = SimpleNamespace(body=FIG4, h0="1.3342", seed=5)
    scene = scenes.of_problem(asked, 2)
    assert scene.h0 == pytest.approx(1.3342, rel=1e-15)
    assert scene.rotation * scene.body.kappa * scene.J2 == pytest.approx(math.tau)
    starts = scene.starts(3, 1e-4, 1e-2)
    M, gamma = body_from_aligned(Aligned(*starts), FIG4.alpha0, 1.0)
    assert np.linalg.norm(M, axis=0) == pytest.approx(scene.J2, rel=1e-14)
    assert (M * gamma).sum(axis=0) == pytest.approx(1e-2, rel=1e-12)
    assert not np.array_equal(starts, scene._replace(seed=6).starts(3, 1e-4, 1e-2))
