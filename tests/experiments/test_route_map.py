"""The experiment `route_map`: cells are orbits, tiles are kept, and two results are told apart."""

from collections.abc import Iterator
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend import Body, route_codes
from rigidpend.experiments.contract import Means
from rigidpend.experiments.route_map import compute as route_map
from rigidpend.experiments.route_map.draw import tables
from rigidpend.machine import files
from rigidpend.numbers.texts import NO_SYMBOL
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.routes import choice, costs
from rigidpend.routes.cells import Cells, cells_of_starts
from tests.experiments.trees import asked, computed, differences

SMALL = (
    "problem.zooms={}",
    "problem.theta2_0.count=5",
    "problem.rows={axis: log10_J1_0, ends: [-10, -5], count: 4}",
    "problem.n_symbols=3",
    "numerics.precisions=[53]",
)
ONE_ZOOM = "problem.zooms={near: {theta2_0: [4.3, 5.1], rows: [-8.4, -7.6]}}"


def content(*settings: str) -> Any:
    return asked("route_map", *SMALL, *settings)


@pytest.fixture(scope="module")
def data() -> Any:
    return computed(content(ONE_ZOOM))


def test_a_plane_has_room_for_the_cells_of_all_its_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    afford = Mock()
    monkeypatch.setattr(files, "afford", afford)
    content(ONE_ZOOM)
    afford.assert_called_once_with("theta2_0", 2 * 5 * 4, 3 + 2, "40 cells of 3 symbols")


def test_a_plane_is_computed_while_its_file_is_written_and_never_held_as_a_whole() -> None:
    """Of forty million cells of 8 symbols the arrays are 400 MB."""
    done = Mock()
    means = Means(resolve("taylor", None, (53,)), report=done)
    config = content("problem.rows={axis: mu, ends: [1/1000, 2/1000], count: 3}")
    plane: Any = route_map.compute(config, means)
    assert {name for name, x in plane.items() if isinstance(x, np.ndarray)} == {"x", "y"}
    assert (plane["codes"].block, plane["certain"].block) == ((3, 1, 5), (1, 5))
    next(plane.blocks)
    assert not done.called
    assert {*next(plane.blocks)} == {"codes", "certain", "by_map"}
    done.assert_called_once()


def test_progress_is_a_share_of_the_cells_of_all_planes() -> None:
    heard: list[Any] = []
    computed(content(ONE_ZOOM), report=heard.append)
    assert sorted(heard) == ["near: 20 of 20 cells", "plane: 20 of 20 cells"]
    assert [line.share for line in heard] == [0.5, 1.0]


def test_no_name_of_a_zoom_makes_it_another_plane() -> None:
    """A zoom of the name that the whole plane has in parts, or in tables, was taken for that."""
    ends = "{theta2_0: [4.3, 5.1], rows: [-8.4, -7.6]}"
    parts: list[str] = []
    named = computed(content(f"problem.zooms={{plane: {ends}, whole: {ends}}}"), parts)
    assert len(set(parts)) == len(parts) == 3
    result: Any = {"data": named}
    [table] = tables(result)
    certain = [int(x["certain"].sum()) for x in (named, *named["zooms"].values())]
    assert [(row[0], int(row[-2])) for row in table.rows] == [
        *zip(("whole", "plane", "whole"), certain, strict=True)
    ]


def test_cells_have_the_middles_of_their_axes(data: Any) -> None:
    assert data["codes"].shape == (3, 4, 5)
    assert data["x"] == pytest.approx(2 * np.pi * (np.arange(5) + 0.5) / 5)
    assert data["y"] == pytest.approx([-9.375, -8.125, -6.875, -5.625])
    assert float(data["marked"]) == pytest.approx(-8, rel=1e-15, abs=0)
    # Zooms have as many.
    near = data["zooms"]["near"]
    assert near["codes"].shape == data["codes"].shape
    assert near["x"][0] == pytest.approx(4.38)
    assert near["y"][-1] == pytest.approx(-7.7)


def assert_alone(found: Any, values: dict[str, Any], column: int, row: int, ladder: Any) -> None:
    """A cell has the certain symbols of its own orbit alone, its body by closed forms in doubles.

    `values` are those of Fig. 4 but for what the axes give.
    """
    n = len(found["codes"])
    J1_0 = 10.0 ** values["log10_J1_0"] if "log10_J1_0" in values else "1e-8"
    start = {"h0": values.get("h0", "1.3342"), "J1_0": J1_0, "n_symbols": n}
    how: Any = {"precisions": ladder, "method": "integration"}
    alone = route_codes(body_of(values), [values["theta2_0"]], **start, **how)
    assert alone.certain.all()
    assert found["certain"][row, column] == n
    assert (alone.codes[:, 0] == found["codes"][:, row, column]).all()


@pytest.mark.parametrize(
    ("across", "phase"),
    [
        ("problem.theta2_0={ends: [0, 1], count: 2}", ""),
        ("problem.columns={axis: log10_J1_0, ends: [-9, -7], count: 2}", "0.3"),
        ("problem.columns={axis: h0, ends: [1, 2], count: 2}", "4.7"),
    ],
)
def test_what_all_cells_share_is_exact_and_not_the_nearest_double(across: str, phase: str) -> None:
    """1e-8, 0.3 and 4.7 are no doubles, and errors of that size grow to other symbols."""
    ladder = (53, 106, 160)
    given = ["problem.n_symbols=45", f"numerics.precisions={list(ladder)}", across]
    rows = "problem.rows={axis: mu, ends: [0, 1/256], count: 2}"
    found = computed(content(*given, rows, *([f"problem.theta2_0={phase}"] if phase else [])))
    name = str(found.get("x_axis", "theta2_0"))
    for row, column in np.ndindex(2, 2):
        axes = {name: float(found["x"][column]), "mu": float(found["y"][row])}
        assert_alone(found, {"theta2_0": phase} | axes, column, row, ladder)


def body_of(values: dict[str, float]) -> Body:
    """The body of a cell, from its angles by closed forms in doubles."""
    beta0, alpha0 = values.get("beta0"), values.get("alpha0")
    r = (1, 1, 0) if beta0 is None else (float(np.cos(beta0 / 2)), float(np.sin(beta0 / 2)), 0)
    # tan^2(alpha0/2) = A1 (A3 - A2)/(A2 (A1 - A3)), solved for A3.
    slope = 2 if alpha0 is None else float(np.tan(alpha0 / 2)) ** 2
    return Body((2, 1, 2 * (1 + slope) / (2 + slope)), r, values.get("mu", "0.001"))


ENDS = {
    "theta2_0": "[0, 6]",
    "log10_J1_0": "[-9, -7]",
    "mu": "[1/1000, 2/1000]",
    "h0": "[1, 2]",
    "beta0": "[0.5, 2]",
    "alpha0": "[1.6, 2]",
}
PAIRS = [
    ("log10_J1_0", "mu"),
    ("mu", "log10_J1_0"),
    ("log10_J1_0", "theta2_0"),
    ("h0", "theta2_0"),
    ("mu", "h0"),
    ("beta0", "alpha0"),
    ("theta2_0", "log10_J1_0"),
]


def axis_of(name: str, count: int) -> str:
    return f"{{axis: {name}, ends: {ENDS[name]}, count: {count}}}"


def over(across: str, upwards: str, *settings: str) -> Any:
    axes = f"problem.columns={axis_of(across, 3)}", f"problem.rows={axis_of(upwards, 4)}"
    return content("problem.theta2_0=1.2", *axes, *settings)


@pytest.mark.slow
@pytest.mark.parametrize(("across", "upwards"), PAIRS)
def test_any_two_parameters_make_a_plane_whose_cells_are_their_orbits(
    across: str, upwards: str
) -> None:
    found = computed(over(across, upwards))
    assert found["codes"].shape == (3, 4, 3)
    assert (str(found["x_axis"]), str(found["y_axis"])) == (across, upwards)
    for row, column in np.ndindex(4, 3):
        values = {across: float(found["x"][column]), upwards: float(found["y"][row])}
        assert_alone(found, {"theta2_0": 1.2} | values, column, row, (53,))
    own = {"theta2_0": 1.2, "log10_J1_0": -8, "mu": 0.001, "h0": 1.3342}
    own |= {"beta0": np.pi / 2, "alpha0": 1.9106332362490186}
    assert float(found["marked_x"]) == pytest.approx(own[across])
    assert float(found["marked"]) == pytest.approx(own[upwards])


@pytest.mark.parametrize(
    ("across", "upwards", "tiles"),
    [
        ("theta2_0", "log10_J1_0", 2),
        ("log10_J1_0", "theta2_0", 2),
        ("theta2_0", "mu", 7),
        ("mu", "log10_J1_0", 5),
        ("mu", "h0", 3),
    ],
)
def test_tiles_share_what_they_can_and_have_every_cell_once(
    across: str, upwards: str, tiles: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(route_map, "TILE", 20)
    monkeypatch.setattr(route_map, "OWN_TILE", 15)
    times, found = np.zeros((7, 5), dtype=int), list(route_map.tiled((across, upwards), 7, 5))
    for _, place in found:
        times[place] += 1
    assert (times == 1).all()
    assert len({number for number, _ in found}) == tiles


def test_cells_are_in_their_places_row_by_row(monkeypatch: pytest.MonkeyPatch) -> None:
    each = np.arange(20, dtype=np.uint8)
    cells = Cells(np.array([each, each + 20, each + 40]), each, each % 3 == 0)
    monkeypatch.setattr(route_map, "row_by_row", Mock(return_value=cells))
    found = computed(content())
    for name in ("codes", "certain", "by_map"):
        want = getattr(cells, name)
        np.testing.assert_array_equal(found[name], want.reshape(*want.shape[:-1], 4, 5))


def test_tiles_are_kept_and_none_is_computed_twice(
    monkeypatch: pytest.MonkeyPatch, data: Any
) -> None:
    monkeypatch.setattr(route_map, "TILE", 10)
    kept: dict[str, Any] = {}

    def pieces(several: Any) -> Iterator[Any]:
        for piece in several:
            if piece.name not in kept:
                kept[piece.name] = piece.compute()
            yield kept[piece.name]

    given = content(ONE_ZOOM)
    assert not differences("route_map", data, computed(given, pieces=pieces))
    assert len(kept) == 4
    monkeypatch.setattr(route_map, "row_by_row", lambda *_: pytest.fail("computed again"))
    assert not differences("route_map", data, computed(given, pieces=pieces))


def test_planes_share_the_tables_of_all_their_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    cells = Mock(wraps=cells_of_starts)
    monkeypatch.setattr(route_map, "cells_of_starts", cells)
    computed(content(ONE_ZOOM))
    computed(content(ONE_ZOOM.replace("-8.4", "-10")))
    asked = [(common["ends"], common["orbits"]) for _, common in cells.call_args_list]
    # Twice 20 cells, from the lowest row of the plane to its highest, or from a zoom's to that.
    ends = (10**-9.375, 10**-5.625), (10**-9.7, 10**-5.625)
    assert asked == [(pytest.approx(x), 40) for x in ends for _ in range(2)]


@pytest.mark.parametrize(
    ("pair", "arrays", "weights", "begun", "actions"),
    [
        (PAIRS[0], 4, [1125, 1375, 1625, 1875], route_map.BEGUN + route_map.OWN_BODY, 3),
        (PAIRS[1], 3, [1167, 1500, 1833], route_map.BEGUN + route_map.OWN_BODY, 4),
        (PAIRS[2], 1, [1000], 0, 3),
        (PAIRS[3], 3, [1000] * 3, route_map.BEGUN, 0),
    ],
)
@pytest.mark.parametrize("many", [False, True])
def test_a_plane_costs_an_array_of_orbits_for_each_body(
    monkeypatch: pytest.MonkeyPatch,
    pair: tuple[str, str],
    arrays: int,
    weights: list[int],
    begun: float,
    actions: int,
    many: bool,
) -> None:
    """Each as its own, in the precisions of the config, with what precedes orbits.

    Of many orbits maps place the actions at no cost.
    """
    seconds = Mock(side_effect=lambda one, *_: 7000 * float(one.body.mu))
    monkeypatch.setattr(choice, "expected_seconds", seconds)
    monkeypatch.setattr(costs, "at_stake", lambda *_: many)
    given = over(*pair)
    begun += 0 if many else actions * route_map.OWN_ACTION
    expected = route_map.BEGIN + 7e-3 * sum(weights) + begun * arrays
    assert route_map.cost(given) == pytest.approx(expected, rel=1e-3)
    bodies, *others = zip(*(call.args for call in seconds.call_args_list), strict=True)
    assert [round(1e6 * float(one.body.mu)) for one in bodies] == weights
    assert others == [(12 // arrays,) * arrays, (given.numerics.precisions,) * arrays]


def test_many_bodies_cost_as_some_of_them_do_from_end_to_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """And a zoom as the bodies of its own rows."""
    seconds = Mock(return_value=1.0)
    monkeypatch.setattr(choice, "expected_seconds", seconds)
    rows = "problem.rows={axis: mu, ends: [0, 0.016], count: 160}"
    zooms = "problem.zooms={low: {theta2_0: [0, 1], rows: [0, 0.0016]}}"
    cost = route_map.cost(content(rows, zooms, "problem.theta2_0.count=8"))
    assert 320 < cost < 323
    weights = [float(call.args[0].body.mu) for call in seconds.call_args_list]
    assert weights == pytest.approx(
        [width * (10.5 + 20 * k) for width in (1e-4, 1e-5) for k in range(8)]
    )


def test_a_run_says_of_how_many_cells_orbits_do_not_return() -> None:
    """Of this nearly symmetric body more than a quarter, in doubles as in 160 bits."""
    body = ("problem.A=[2, 1.9, 1.95]", "problem.r=[0, 1, 0]", "problem.mu=0.24", "problem.h0=1")
    rows = "problem.rows={axis: mu, ends: [0.23, 0.25], count: 4}"
    reported: list[str] = []
    given = asked("route_map", *SMALL, *body, rows, "problem.theta2_0.count=10")
    codes = computed(given, report=reported.append)["codes"]
    stay = int((codes == NO_SYMBOL).any(axis=0).sum())
    assert stay > 10
    said = f"; {stay} stay beside a pendulum motion, and no number of bits decides"
    assert reported[-1] == f"plane: 40 of 40 cells{said}"
    reported.clear()
    computed(content(), report=reported.append)
    assert reported[-1] == "plane: 20 of 20 cells"
