"""What all results have in common: they are what their file holds, and in parts what was asked."""

import functools
import operator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from rigidpend import experiments
from rigidpend.experiments.data import fields
from rigidpend.render import captions
from tests.cli.calls import REFERENCE
from tests.experiments.trees import differences, from_file, reference


def coordinates(path: Path) -> set[str]:
    """The arrays of a file that are the coordinate along a dimension, behind its name."""
    found: set[str] = set()

    def look(name: str, node: Any) -> None:
        if isinstance(node, h5py.Dataset) and node.is_scale:
            found.add(f"{node.dims[0].label}: {name.rpartition('/')[2]}")

    with h5py.File(path) as file:
        file["data"].visititems(look)
    return found


COORDINATES = {
    "asymptotic_orbits": {"columns: theta2_0", "samples: t"},
    "exponents": {"columns: theta2_0"},
    "fig2": {"vertices: label"},
    "fig4": {"columns: theta2_0"},
    "fig4_intervals": {"columns: theta2_0"},
    "fig4_zoom": {"columns: offset"},
    "fig5": {"samples: t"},
    "precession": {"bodies: name", "mu: mu_over_h0"},
    "splitting": {"bodies: name", "mu: mu_over_h0", "phases: g"},
}
"""By reference; all others have none."""


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(path.stem for path in REFERENCE.glob("*.h5")))
def test_a_result_has_tables_and_differs_neither_from_itself_nor_from_its_file(
    name: str, tmp_path: Path
) -> None:
    result = reference(name)
    experiment = result["attributes"]["experiment"]
    layout = experiments.layout(experiment)
    again = from_file(tmp_path, experiment, result["data"])["data"]
    assert differences(experiment, result["data"], again) == []
    tables = experiments.tables(result)
    assert tables
    assert all(table.rows for table in tables)
    assert "A = (2, " in " ".join(captions.bodies(result))
    assert coordinates(tmp_path / f"{experiment}.h5") == COORDINATES.get(name, set())
    stored, kept = ({x[0]: x[1] for x in fields(layout, y)} for y in (result["data"], again))
    assert [*stored] == [*kept]
    for place, values in stored.items():
        np.testing.assert_array_equal(values, kept[place], err_msg=place)


@pytest.mark.parametrize("name", sorted(path.stem for path in REFERENCE.glob("*.h5")))
def test_a_reference_says_of_each_array_what_its_layout_says(name: str) -> None:
    """And all symbols are declared to be left, right or none."""
    result = reference(name)
    layout = experiments.layout(result["attributes"]["experiment"])
    with h5py.File(REFERENCE / f"{name}.h5") as file:
        for place, _, field in fields(layout, result["data"]):
            said = file[f"data/{place}"].attrs
            assert (said["units"], said["description"]) == (field.units, field.description), place
            assert not place.endswith("codes") or field.among == (0, 1, 255), place


ALLOWED: list[tuple[str, str, Any, float]] = [
    *(("closed_orbits", f"orbits/{x}", 3, 1e-12) for x in ("period", "action")),
    # Twice what is stated of it, and a hundredth.
    ("closed_orbits", "orbits/exponent", 3, 1.406e-12),
    ("closed_orbits", "orbits/exponent_error", 3, 7.028e-15),
    ("closed_orbits", "averages/mean", 1, 1e-9),
    ("closed_orbits", "places/d", 7, 1e-9),
    ("asymptotic_orbits", "orbits/2/theta2_0_rest", 5, 2e-29),
    ("asymptotic_orbits", "orbits/2/flight", 5, 1e-10),
    ("asymptotic_orbits", "orbits/2/theta3", 5, 1e-12),
    ("asymptotic_orbits", "drawn/0/theta3", 9, 1e-6),
    *(
        ("fig5", "case1/crossing_error", k, allowed)
        for k, allowed in enumerate((1e-12, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4))
    ),
    # 1e-12, and 1e-8 t' of its largest slope, between the first two crossings.
    ("fig5", "case1/theta3", 1000, 7.194e-11),
    # Twice what is admitted of each, at mu/h0 = 1e-6 and from 1e-3 on.
    ("splitting", "bodies/excess", (0, 0, 1), 8e-15),
    ("splitting", "bodies/excess", (0, -1, 1), 2e-9),
    ("splitting", "bodies/curve_excess", (0, 0), 16 * 8e-15),
    # Of five weights, a decade apart: 2, 1, 0, 1 and 2 tenths of what is admitted of each
    # logarithm, over ln 10. Of a curve it is that of 16 harmonics.
    ("splitting", "bodies/slope_amplitude", 0, 2.5607e-3),
    ("splitting", "bodies/slope_curve", 8, 9.5414e-7),
    ("precession", "bodies/slope", (0, 1), 1e-3),
    # Errors of both; the bound of a check is that of two ways already.
    ("exponents", "exponent", (1, 1), 1.1642e-10),
    ("exponents", "checked/growth", 2, 2.677e-10),
    ("fig4", "left/crossing_time", (0, 0), 1e-12),
    ("fig4", "left/crossing_time", (3, 4), 1.225e-7),
    ("fig1", "orbits/theta1", 5, 1e-14),
    # A millionth of the largest; a twentieth of what is between 0 and 1.
    ("full_shift", "sets/a", 0, 6.9323e-15),
    ("full_shift", "relations/across", (0, 0), 0.05),
]
"""By how much a value of a reference may change, and no more."""
STATED: list[tuple[str, str, Any, float]] = [
    ("closed_orbits", "orbits/residual", 3, 1e-10),
    # Of the shortest period and of the longest.
    ("closed_orbits", "orbits/alone", 3, 6e-12 * 37.947121353480),
    ("closed_orbits", "orbits/alone", 45, 6e-12 * 265.629933037466),
    ("closed_orbits", "orbits/closing", 3, 1e-15),
    ("asymptotic_orbits", "orbits/2/moved", 5, 1e-12),
    ("splitting", "bodies/error", (0, 0), 4e-15),
    ("splitting", "bodies/error", (0, -1), 1e-9),
    ("exponents", "checked/difference", 2, 2.677e-10),
    # Of the largest increment there is, at mu/h0 = 1e-5.
    ("precession", "bodies/error", (0, 0), 4.44288e-17),
]
"""How large an error that a result states of itself may be."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "place", "at", "allowed", "stated"),
    [*((*case, False) for case in ALLOWED), *((*case, True) for case in STATED)],
)
def test_a_result_may_differ_by_what_is_declared_and_no_more(
    name: str, place: str, at: Any, allowed: float, stated: bool
) -> None:
    result, other = reference(name), reference(name)["data"]
    array = functools.reduce(operator.getitem, place.split("/"), other)
    begin = 0.0 if stated else array[at]
    for part, found in ((0.99, 0), (1.01, 1)):
        array[at] = begin + part * allowed
        experiment = result["attributes"]["experiment"]
        assert len(differences(experiment, result["data"], other)) == found


def test_a_map_that_doubles_resolve_less_may_move_its_orbits_more() -> None:
    """Ten times as far as they were moved in the stored result."""
    data, other = (reference("asymptotic_orbits")["data"] for _ in range(2))
    data["orbits"]["2"]["moved"][3] = -1e-9
    for moved, found in ((0.99e-8, 0), (-1.01e-8, 1)):
        other["orbits"]["2"]["moved"][5] = moved
        assert len(differences("asymptotic_orbits", data, other)) == found


@pytest.mark.slow
def test_a_stated_error_opens_no_tolerance() -> None:
    data, other = (reference("precession")["data"] for _ in range(2))
    other["bodies"]["error"][:] = 1
    other["bodies"]["gained"] += 1e-6
    assert any("bodies/gained" in x for x in differences("precession", data, other))
