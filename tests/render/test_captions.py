"""The line at the foot of a figure tells what its axes do not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rigidpend.render import captions
from rigidpend.runs import loading

PLANE = Path(__file__).parents[2] / "configs" / "route_map.yaml"
BODY = "A = (2, 1, 1.5), r along (1, 1, 0), mu = 0.001, h0 = 1.3342, J1_0 = 1e-8"


def told(*settings: str) -> list[str]:
    """The captions of a result of the plane, with settings."""
    result: Any = {"config": loading.load(PLANE, settings).resolved()}
    return captions.bodies(result)


def test_a_phase_that_all_cells_have_is_told() -> None:
    columns = "problem.columns={axis: h0, ends: [1, 2], count: 4}"
    found = told("problem.theta2_0=4.7057", columns, "problem.zooms={}")
    assert found == [f"{BODY}, theta2_0 = 4.7057"]
    # Phases along an axis are not.
    assert told() == [BODY]


def test_the_energy_and_the_half_rotations_of_closed_orbits_are_told() -> None:
    result: Any = {"config": loading.load(PLANE.with_name("closed_orbits.yaml")).resolved()}
    [found] = captions.bodies(result)
    assert found.endswith("mu = 0.001, h = 1.3342, half_turns = 11")


def test_the_foot_says_what_one_sees_and_of_several_results_what_they_share() -> None:
    def result(**problem: Any) -> Any:
        return {"attributes": {"experiment": "route_codes"}, "config": {"problem": problem}}

    light, heavy = (result(A=["2", "1", "3/2"], h0="1", mu=mu) for mu in ("1/1000", "1/100"))
    seen, one = captions.foot("light", [light])
    assert captions.caption("route_codes").startswith(f"{seen} A column ")
    assert one == "light: A = (2, 1, 1.5), mu = 0.001, h0 = 1"
    assert captions.foot("both", [light, heavy]) == [seen, "both: A = (2, 1, 1.5), h0 = 1"]
