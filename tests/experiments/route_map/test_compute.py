"""The experiment `route_map`: cells are orbits, tiles are kept, and two results are told apart."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidpend import Body, route_codes
from rigidpend.config import loading
from rigidpend.experiments.contract import Means
from rigidpend.experiments.route_map import compute as route_map
from rigidpend.integrate.arithmetic import resolve
from rigidpend.integrate.engines import default_engine
from tests.config.samples import refused
from tests.experiments.trees import plain

SHIPPED = Path(__file__).parents[3] / "configs" / "route_map.yaml"
SMALL = (
    "problem.theta2_0.count=5",
    "problem.rows.count=4",
    "problem.n_symbols=3",
    "numerics.precisions=[53]",
)
ONE_ZOOM = "problem.zooms={near: {theta2_0: [4.3, 5.1], rows: [-8.4, -7.6]}}"
ROWS: dict[str, str] = {
    "mu": "{axis: mu, ends: [1/1000, 2/1000], count: 4}",
    "h0": "{axis: h0, ends: [1, 2], count: 4}",
    "beta0": "{axis: beta0, ends: [0.5, 2], count: 4}",
    "alpha0": "{axis: alpha0, ends: [1.6, 2], count: 4}",
}


def content(*settings: str) -> Any:
    return loading.load(SHIPPED, [*SMALL, *settings]).content


def computed(given: Any, **more: Any) -> Any:
    return route_map.compute(given, Means(resolve(default_engine(), None, (53,)), **more))


@pytest.fixture(scope="module")
def tree() -> Any:
    return computed(content(ONE_ZOOM))


@pytest.fixture
def data(tree: Any) -> Any:
    return plain(tree)


def test_every_cell_is_the_orbit_of_its_middle(data: Any) -> None:
    assert data["codes"].shape == (3, 4, 5)
    assert data["x"] == pytest.approx(2 * np.pi * (np.arange(5) + 0.5) / 5)
    assert data["y"] == pytest.approx([-9.375, -8.125, -6.875, -5.625])
    body = Body((2, 1, "1.5"), (1, 1, 0), "0.001")
    for row, y in enumerate(data["y"]):
        alone = route_codes(body, data["x"], h0="1.3342", J1_0=10.0**y, n_symbols=3)
        known = np.arange(3)[:, None] < data["certain"][row]
        assert (alone.codes == data["codes"][:, row])[known].all()
    assert data["certain"].mean() > 2.9
    assert float(data["marked"]) == pytest.approx(-8, rel=1e-15)


def test_zooms_have_as_many_cells(data: Any) -> None:
    near = data["zooms"]["near"]
    assert near["codes"].shape == data["codes"].shape
    assert near["x"][0] == pytest.approx(4.38)
    assert near["y"][-1] == pytest.approx(-7.7)


@pytest.mark.parametrize("axis", ROWS)
def test_rows_of_other_bodies_and_energies(axis: str) -> None:
    given = content("problem.zooms={}", f"problem.rows={ROWS[axis]}")
    found = plain(computed(given))
    y, x = found["y"], found["x"]
    half = float(y[2]) / 2
    r = (float(np.cos(half)), float(np.sin(half)), 0) if axis == "beta0" else (1, 1, 0)
    # tan^2(alpha0/2) = A1 (A3 - A2)/(A2 (A1 - A3)), solved for A3.
    slope = float(np.tan(half)) ** 2
    A3 = 2 * (1 + slope) / (2 + slope) if axis == "alpha0" else "1.5"
    body = Body((2, 1, A3), r, float(y[2]) if axis == "mu" else "0.001")
    h0 = float(y[2]) if axis == "h0" else "1.3342"
    alone = route_codes(body, x, h0=h0, J1_0="1e-8", n_symbols=3)
    known = np.arange(3)[:, None] < found["certain"][2]
    assert (alone.codes == found["codes"][:, 2])[known].all()
    assert known.all()
    own = {"mu": 0.001, "h0": 1.3342, "beta0": np.pi / 2, "alpha0": 1.9106332362490186}
    assert float(found["marked"]) == pytest.approx(own[axis])


def test_tiles_are_kept_and_none_is_computed_twice(
    monkeypatch: pytest.MonkeyPatch, data: Any
) -> None:
    monkeypatch.setattr(route_map, "TILE", 10)
    names: list[str] = []
    kept: dict[str, Any] = {}

    def pieces(several: Any) -> Iterator[Any]:
        for piece in several:
            names.append(piece.name)
            if piece.name not in kept:
                kept[piece.name] = piece.work(*piece.arguments)
            yield kept[piece.name]

    given = content(ONE_ZOOM)
    first = plain(computed(given, pieces=pieces))
    assert len(set(names)) == len(names) == 4
    monkeypatch.setattr(route_map, "_cells", lambda *_: pytest.fail("computed again"))
    again = plain(computed(given, pieces=pieces))
    assert np.array_equal(first["codes"], again["codes"])
    assert not route_map.differences(data, first)


def test_two_results_are_told_apart(data: Any) -> None:
    other = {**data, "codes": data["codes"].copy()}
    assert not route_map.differences(data, other)
    other["codes"][0, 0, 0] ^= 1
    assert len(route_map.differences(data, other)) == 1
    less = {**data, "certain": data["certain"] * 0}
    assert len(route_map.differences(data, less)) == 1
    moved = {**data, "x": data["x"] + 1e-9}
    assert route_map.differences(data, moved)


def test_the_description_says_what_it_costs() -> None:
    rows = {row.name: row.value for row in route_map.describe(content())}
    few = float(rows["cost"].split()[1])
    many = {
        row.name: row.value
        for row in route_map.describe(
            content("problem.theta2_0.count=1250", "problem.rows.count=800", "problem.zooms={}")
        )
    }
    assert few < 1 < float(many["cost"].split()[1]) < 60


@pytest.mark.parametrize(
    ("setting", "field", "reason"),
    [
        ("problem.theta2_0.ends=[2, 1]", "theta2_0", "ascend"),
        ("problem.theta2_0.ends=[1, 1.000000000000001]", "theta2_0", "too fine"),
        ("problem.rows.ends=[-10, 1]", "problem", "J1_0"),
        ("problem.rows={axis: gamma0, ends: [1, 2], count: 4}", "problem.rows", "log10_J1_0"),
        ("problem.rows={axis: alpha0, ends: [1, 4], count: 4}", "problem", "pi > alpha0 > 0"),
        ("problem.rows={axis: h0, ends: [1/10000, 2], count: 4}", "problem", "h0 > mu"),
        ("problem.n_symbols=251", "problem", "at most 250"),
        ("problem.theta2_0.count=1", "count", "2"),
    ],
)
def test_planes_that_make_no_sense_are_refused_with_their_place(
    setting: str, field: str, reason: str
) -> None:
    said = "\n".join(map(str, refused(SHIPPED, [*SMALL, setting])))
    assert field in said
    assert reason in said
