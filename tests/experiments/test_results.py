"""What all results have in common: they are what their file holds, and in parts what was asked."""

from __future__ import annotations

import copy
import functools
import operator
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from rigidpend import experiments
from rigidpend.experiments.data import Field, Layout, declared, fields
from rigidpend.results import store
from rigidpend.runs.parts import packed, unpacked
from tests.cli.calls import REFERENCE
from tests.experiments.trees import (
    CONFIGS,
    asked,
    computed,
    differences,
    from_file,
    plain,
    reference,
)
from tests.processes import modules_of_computing


def declared_again(layout: Layout, data: Any) -> Any:
    """The arrays of a result with what their fields say of them, as if they were computed."""
    return {
        name: node.dataset(texts(data[name]))
        if isinstance(node, Field)
        else declared_again(node, data[name])
        for name, node in declared(layout, data).items()
    }


def texts(values: Any) -> Any:
    return np.char.encode(values.astype(str)) if np.asarray(values).dtype.kind == "O" else values


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
@pytest.mark.parametrize("path", sorted(REFERENCE.glob("*.h5")), ids=lambda path: path.stem)
def test_a_result_does_not_differ_from_itself_nor_from_its_file(path: Path, tmp_path: Path) -> None:
    result = store.load(path)
    experiment = result["attributes"]["experiment"]
    layout = experiments.layout(experiment)
    again = from_file(tmp_path, experiment, declared_again(layout, result["data"]))["data"]
    assert differences(experiment, result["data"], again) == []
    assert coordinates(tmp_path / f"{experiment}.h5") == COORDINATES.get(path.stem, set())
    stored, kept = ({x[0]: x[1] for x in fields(layout, y)} for y in (result["data"], again))
    assert [*stored] == [*kept]
    for place, values in stored.items():
        np.testing.assert_array_equal(values, kept[place], err_msg=place)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "needed"),
    [("fig1", "rigidpend.mechanics.free_body"), ("fig2", "rigidpend.routes.cycle")],
)
def test_what_has_a_closed_form_is_computed_without_an_integrator(name: str, needed: str) -> None:
    path = CONFIGS / f"{name}.yaml"
    found = modules_of_computing(asked(name).experiment, path)
    assert needed in found
    assert found & {"scipy.integrate", "heyoka", "matplotlib"} == set()


PARTS = {
    "asymptotic_orbits": (("problem.symbols=1", "problem.columns=20"), ["0 symbols", "1 symbols"]),
    "fig3": (
        ("problem.theta2_0.count=1", "problem.bodies={a: [2, 1, 1.5], b: [2, 1, 1.6]}"),
        ["a", "b"],
    ),
    "precession": (("problem.mu=[1e-2, 0.1]",), ["i", "ii", "iii", "iv", "v"]),
    "splitting": (
        (
            "problem.bodies={a: {A: [2, 0.2, 1.8], r: [1, 2, 0]},"
            " fig4: {A: [2, 1, 1.5], r: [1, 1, 0]}}",
            "problem.mu=[1e-2, 2e-2]",
        ),
        ["a", "fig4"],
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", PARTS)
def test_each_body_or_length_is_a_part_of_the_run(name: str) -> None:
    settings, expected = PARTS[name]
    parts = []

    def part(name: str, compute: Callable[[], Any]) -> Any:
        parts.append(name)
        # As it comes back where a run was interrupted.
        return unpacked(packed(compute()))

    given = asked(name, *settings)
    in_parts = plain(computed(given, part=part))
    assert parts == expected
    assert experiments.layout(given.experiment).keys() == in_parts.keys()


ALLOWED: list[tuple[str, str, Any, float]] = [
    *(("closed_orbits", f"orbits/{x}", 3, 1e-12) for x in ("period", "action")),
    ("closed_orbits", "orbits/exponent", 3, 1e-11),
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
    ("precession", "bodies/slope", (0, 1), 1e-3),
    ("fig1", "orbits/theta1", 5, 1e-14),
]
"""By how much a value of a reference may change, and no more."""
STATED: list[tuple[str, str, Any, float]] = [
    ("closed_orbits", "orbits/residual", 3, 1e-10),
    ("closed_orbits", "orbits/alone", 3, 1e-9),
    ("closed_orbits", "orbits/closing", 3, 1e-15),
    ("asymptotic_orbits", "orbits/2/moved", 5, 1e-12),
    ("splitting", "bodies/error", (0, 0), 4e-15),
    ("splitting", "bodies/error", (0, -1), 1e-9),
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
    result, other = kept_reference(name), copy.deepcopy(kept_reference(name)["data"])
    array = functools.reduce(operator.getitem, place.split("/"), other)
    begin = 0.0 if stated else array[at]
    for part, found in ((0.99, 0), (1.01, 1)):
        array[at] = begin + part * allowed
        experiment = result["attributes"]["experiment"]
        assert len(differences(experiment, result["data"], other)) == found


@functools.cache
def kept_reference(name: str) -> Any:
    """A reference that none changes."""
    return reference(name)


@pytest.mark.slow
def test_a_stated_error_opens_no_tolerance() -> None:
    data = kept_reference("precession")["data"]
    other = copy.deepcopy(data)
    other["bodies"]["error"] = 1.1e-12 * data["bodies"]["unit"]
    [found] = differences("precession", data, other)
    assert found.startswith("bodies/error[")
    assert "is declared" in found
    other["bodies"]["error"] = 0.9e-12 * data["bodies"]["unit"]
    assert differences("precession", data, other) == []
    other["bodies"]["error"][:] = 1
    other["bodies"]["gained"] += 1e-6
    assert any("bodies/gained" in x for x in differences("precession", data, other))
