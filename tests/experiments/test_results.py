"""What all results have in common: they are what their file holds, and in parts what was asked."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from rigidpend import experiments
from rigidpend.experiments.data.layout import Field, Layout, declared, fields
from rigidpend.results import store
from tests.cli.calls import REFERENCE
from tests.experiments.trees import asked, computed, differences, from_file, plain


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
        return compute()

    given = asked(name, *settings)
    in_parts = plain(computed(given, part=part))
    assert parts == expected
    assert experiments.layout(given.experiment).keys() == in_parts.keys()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "field", "declared"),
    [("precession", "gained", ""), ("splitting", "excess", "at most 4e-15 is declared")],
)
def test_a_stated_error_opens_no_tolerance_and_fails_if_it_is_more_than_declared(
    name: str, field: str, declared: str
) -> None:
    data, other = (store.load(REFERENCE / f"{name}.h5")["data"] for _ in range(2))
    other["bodies"]["error"] += 1
    [found] = differences(name, data, other)
    assert found.startswith("bodies/error[")
    assert "is declared" in found
    assert declared in found
    other["bodies"][field] += 1e-6
    assert any(f"bodies/{field}" in x for x in differences(name, data, other))
