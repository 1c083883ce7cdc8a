"""Zooms into Fig. 4: the change of symbol is found, and its surroundings repeat."""

from fractions import Fraction
from itertools import pairwise
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend.experiments.contract import Means
from rigidpend.experiments.route_zoom import compute as route_zoom
from rigidpend.experiments.route_zoom import draw
from rigidpend.mechanics import floquet
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.arithmetic import DEFAULT_ENGINE, resolve
from rigidpend.routes.neighbourhood import Bracket, NoChange
from rigidpend.routes.problem import RouteProblem
from rigidpend.surfaces import melnikov
from tests.experiments.trees import asked, computed, shared_reference

SMALL = ("problem.levels=3", "problem.count=6", "problem.n_symbols=4")


@pytest.fixture(scope="module")
def given() -> Any:
    return asked("fig4_zoom", *SMALL)


@pytest.fixture(scope="module")
def tree(given: Any) -> Any:
    lines: list[str] = []
    found = computed(given, report=lines.append)
    assert sum("step" in line for line in lines) == 3
    assert lines[0].startswith("the change is known to ")
    return found


def test_the_symbol_changes_in_the_middle_of_every_level_inside_the_one_before(
    tree: Any, given: Any
) -> None:
    """To first order at Melnikov's zero; NOTES: the true change differs from it by 1.05 mu."""
    levels = list(tree["levels"].values())
    steps = [level["step"] for level in levels]
    assert np.allclose(np.divide(steps[:-1], steps[1:]), 9.220614316804648, rtol=1e-12)
    assert tree["repeats_after"] == pytest.approx(9.2206, rel=1e-3)
    for level in levels:
        assert np.flatnonzero(np.diff(level["codes"][0])).tolist() == [2]
    centres = [Fraction(level["centre"]) for level in levels]
    for (a, b), step in zip(pairwise(centres), steps, strict=False):
        assert abs(a - b) < step
    p = given.problem
    zero = melnikov.zeros(RouteProblem(p.body, p.h0, p.J1_0, 1))[1]
    assert float(centres[-1]) - zero == pytest.approx(1.05e-3, rel=0.02)


NEAR = exact("4.705696853133541796838615435875509827847045595186537262085827223")
"""A change of symbol, to 2e-61."""


def test_every_phase_that_is_stored_is_the_number_that_was_used(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Down to 1e-55, around an orbit that has the bits for the last level."""
    # The symbol changes between the first two.
    codes = np.ones((30, 7), dtype=np.uint8)
    codes[0, 0] = 0
    told = {"codes": codes, "certain": codes > 1, "bits": codes[0]}
    seen = SimpleNamespace(codes=codes, certain=codes < 2, _asdict=lambda: told)
    around = Mock(bits=0)
    around.return_value.routes = routes = Mock(return_value=seen)
    monkeypatch.setattr(route_zoom, "Neighbourhood", around)
    step = "pi/32"
    deep = ("factor=1000000", "levels=10", "count=5", "n_symbols=30", f"step={step}")
    content = asked("fig4_zoom", *(f"problem.{each}" for each in deep))
    widths = [exact(step) / 10 ** (6 * level + 8) for level in range(10)]
    known = [Bracket(NEAR - width, NEAR + width) for width in widths]
    monkeypatch.setattr(route_zoom, "narrowed", lambda *_: known)
    found: Any = route_zoom.compute(content, Means(resolve(DEFAULT_ENGINE)))
    [((_, reference, finest, *_), _)] = around.call_args_list
    assert abs(reference.at(2000) - NEAR.at(2000)) < 1e-62
    assert finest == float(exact(step) / 10**54)
    used = [call.args[0][2:] for call in routes.call_args_list]
    for level, phases in zip(found["levels"].values(), used, strict=True):
        centre, stored = exact(level["centre"]), [exact(text) for text in level["theta2_0"]]
        assert stored[2].at(2000) == centre.at(2000)
        assert [x.at(2000) for x in stored] == [x.at(2000) for x in phases]
        # For drawing only.
        assert level["offset"].tolist() == [float(phase - centre) for phase in stored]
    orbits = route_zoom.orbits(content, lambda: found)
    assert [phase.text for phase in orbits["level09"][1]] == level["theta2_0"]
    seen.certain[0, 1] = False
    with pytest.raises(NoChange, match="symbol 1 is not certain beside"):
        route_zoom.compute(content, Means(resolve(DEFAULT_ENGINE)))


def test_the_shipped_zoom_is_by_the_multiplier_and_comes_to_repeat_itself(given: Any) -> None:
    """Level after level more is as before: a change of d/mu leaves less by the factor each time."""
    p = given.problem
    found = floquet.periodic_orbit(p.body.angles(), float(p.h0)).multiplier
    assert float(p.factor) == pytest.approx(found, rel=1e-14, abs=0)
    levels = list(shared_reference("fig4_zoom")["data"]["levels"].values())
    shares = [draw.share(*pair) for pair in pairwise(levels)]
    assert max(shares[:2]) < 0.6
    assert shares[-1] == 1


def test_a_change_that_one_computation_mistook_is_not_passed_on(
    given: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The ends of a bracket are computed again, with certainty."""
    wrong = [Bracket(exact("4.71"), exact("4.71") + exact("1e-9"))]
    monkeypatch.setattr(route_zoom, "narrowed", lambda *_: wrong)
    with pytest.raises(NoChange, match=r"symbol 1 must change.* at 4\.71 and .* at 4\.710000001;"):
        computed(given)
