"""Starts are where they say; extremes are what they are named; what is conserved is kept."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.experiments.stress import conserved, extremes, roundings, scenes
from rigidpend.experiments.stress.scenes import Scene
from rigidpend.mechanics.coordinates import (
    Aligned,
    body_from_aligned,
    canonical_from_aligned,
    scale,
)
from rigidpend.numbers.exact import context
from rigidpend.orbits.integrate import Crossings
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.routes.certainty import FIRST_SCALES
from rigidpend.routes.problem import phase_rate
from rigidpend.routes.run import Run
from tests.bodies import FIG4, GENERIC, THIN, problem
from tests.experiments.stress.verdicts import changed, failed, verdicts

PROBLEM = problem(n_symbols=1, J1_0="1e-6")
ORDINARY = extremes.Extreme("x", J1_0="1e-3")
EVERY = [x for members in extremes.GROUPS.values() for x in members]
RATE = phase_rate(problem(J1_0="1e-3"))
SCENE = Scene(GENERIC, 1.3, 1, 4)


def test_phase_errors_count_another_separatrix_as_infinite() -> None:
    def record(times: list[float], beside: list[int]) -> Crossings:
        outcome = np.zeros(1, dtype=np.uint8)
        return Crossings(np.array([times]).T, np.array([beside], dtype=np.uint8).T, outcome)

    found = record([1.0, 2.5, np.nan, np.nan], [2, 1, 0, 0])
    true = record([1.25, 2.5, np.nan, 9.0], [2, 3, 0, 4])
    assert scenes.phase_errors(found, true, 2.0)[:, 0].tolist() == [0.5, np.inf, 0.0, np.inf]


def test_coefficients_of_a_thin_body_keep_their_digits() -> None:
    """twist is 1/(2 sin(alpha0)), where alpha0 in doubles gives eight digits."""
    sine = context(113).sin(THIN.angles(113).alpha0)
    assert Scene(THIN, 1.0).c.twist == pytest.approx(float(1 / (2 * sine)), rel=4e-16, abs=0)


@pytest.mark.parametrize("place", extremes.PLACES, ids=lambda x: x.name)
def test_places_are_where_they_say(place: scenes.Place) -> None:
    made = Aligned(*place.state(FIG4, 0.7))
    M, gamma = body_from_aligned(made, FIG4.alpha0, 1.0)
    back = canonical_from_aligned(made, FIG4.alpha0, FIG4.beta0)
    assert M @ gamma == pytest.approx(place.J3, abs=1e-14)
    assert float(back.J1) == pytest.approx(place.J1, rel=1e-12, abs=0)
    assert float(back.J2mJ1) == pytest.approx(place.J2mJ1, rel=1e-12, abs=0)
    large, small = (made.Qp, made.Qm) if place.separatrix in (2, 4) else (made.Qm, made.Qp)
    assert (small == 0) == (place.aside == 0)
    assert np.sign(large) == {1: -1, 2: 1, 3: 1, 4: -1}[place.separatrix]


def test_the_truth_is_computed_as_it_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """By that engine, in that precision, of all phases."""
    phases = ["0.4", "2.1"]
    monkeypatch.setattr(Run, "crossings", lambda run, *given: (run, *given))
    made: Any = scenes.route_crossings(PROBLEM, phases, 3, 160, "scipy")
    run, *given, columns = made
    asked_of = run.problem, run.arithmetic, run.jobs, run.phases.high.tolist()
    assert asked_of == (PROBLEM, resolve("scipy", None, (160,)), 3, [0.4, 2.1])
    assert (given, list(columns)) == ([160, FIRST_SCALES], [0, 1])


def test_starts_have_the_energy_and_the_J3_that_are_asked_for() -> None:
    asked: Any = SimpleNamespace(body=FIG4, h0="1.3342", seed=5)
    scene = scenes.of_problem(asked, 2)
    assert scene.h0 == pytest.approx(1.3342, rel=1e-15, abs=0)
    assert scene.rotation * scene.body.kappa * scene.J2 == pytest.approx(math.tau)
    starts = scene.starts(3, 1e-4, 1e-2)
    M, gamma = body_from_aligned(Aligned(*starts), FIG4.alpha0, 1.0)
    assert np.linalg.norm(M, axis=0) == pytest.approx(scene.J2, rel=1e-14, abs=0)
    assert (M * gamma).sum(axis=0) == pytest.approx(1e-2, rel=1e-12, abs=0)
    assert not np.array_equal(starts, scene._replace(seed=6).starts(3, 1e-4, 1e-2))


def run(extreme: extremes.Extreme = ORDINARY) -> set[str]:
    return {x.removeprefix("x: ") for x in failed(extremes.trial("bodies", extreme, 1, 1, 1))}


def test_every_body_is_one_and_special_ones_are_special() -> None:
    bodies = {x.name: Body(x.A, x.r, x.mu) for x in EVERY}
    assert all(name in bodies[name].special_cases for name in ("Hess", "Grioli", "flat"))
    angles = [body.angles() for body in bodies.values()]
    assert min(p.alpha0 for p in angles) < 0.11
    assert max(p.alpha0 for p in angles) > np.pi - 0.11
    assert {p.beta0 for p in angles} >= {0.0, np.pi}


@pytest.mark.parametrize(
    ("change", "fails"),
    [
        (lambda x: x, set()),
        (lambda x: x._replace(separatrix=x.separatrix % 4 + 1), {"error"}),
        # A hundredth of a radian is the most that passes.
        (lambda x: x._replace(crossing_time=x.crossing_time + 0.008 / RATE), set()),
        (lambda x: x._replace(crossing_time=x.crossing_time + 0.012 / RATE), {"error"}),
        (lambda x: x._replace(certain=np.zeros_like(x.certain)), {"uncertain"}),
    ],
)
def test_what_is_wrong_late_or_uncertain_fails(
    change: Any, fails: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    changed(monkeypatch, lambda made, _: change(made))
    assert run() == fails


def test_a_start_passes_and_a_spoilt_tolerance_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    place = scenes.Place("x", 3, 1e-3, 1.4, 1e-4, 0.2)
    trial = extremes.start_trial(GENERIC, place, 1, 1, 2)
    assert failed(trial) == set()
    monkeypatch.setattr(scenes, "DEFAULT_TOLERANCE", {"taylor": 1e-6})
    assert failed(trial) == {"x"}


def test_all_hold_and_wrong_mirrors_and_large_errors_do_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    trial = conserved.symmetries(SCENE)
    right = verdicts(trial)
    assert (set(right.values()), len(right)) == ({"passed"}, 3)
    monkeypatch.setattr(conserved, "MIRRORED", np.arange(5))
    monkeypatch.setattr(conserved, "REVERSAL", -conserved.REVERSAL)
    monkeypatch.setattr(roundings, "NOISE", roundings.NOISE / 100)
    assert failed(trial) == set(right)


def drift(tolerance: float) -> Any:
    return conserved.drift_trial(SCENE, tolerance, 300, 8).tried()


def test_integrals_are_energy_length_and_projection() -> None:
    s = float(scale(GENERIC.floats()[0]))
    M, gamma = body_from_aligned(Aligned(*SCENE.starts(3, 1e-4, 0.2 * SCENE.J2)), GENERIC.alpha0, s)
    h, half_square, along = conserved.integrals(SCENE, M, gamma)
    assert np.allclose(half_square, 0.5, rtol=1e-15)
    assert np.allclose(along, 0.2, rtol=1e-14)
    # On the separatrix without weight the energy is h0.
    assert np.allclose(h, 1, atol=float(GENERIC.mu) / (GENERIC.kappa * 1.3**2 / 2))


def test_slope_is_the_power_of_the_late_times() -> None:
    rotations = np.geomspace(1, 1e4, 61)
    row = 1e-16 * rotations**0.7 + np.where(rotations < 90, 1e-10, 0)
    assert conserved.slope(rotations, row) == pytest.approx(0.7)


def test_the_finest_tolerance_walks_at_random_and_a_coarse_one_does_not() -> None:
    assert failed(drift(2.0**-52)) == set()
    coarse = list(verdicts(drift(1e-9)).values())
    assert coarse.count("FAILED") >= 2, "no declared bias is as large"
