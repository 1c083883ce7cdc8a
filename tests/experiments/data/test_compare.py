"""Comparing trees of arrays: floats to within what is allowed, all else exactly."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.data.compare import (
    Difference,
    attributes,
    beyond,
    differences,
    inside,
    outlines,
    plain,
)


def tree() -> dict[str, Any]:
    return {
        "a": {"x": np.array([[1.0, 2.0], [np.nan, 4.0]]), "n": np.array([1, 2])},
        "b": np.array(["p", "q"], dtype=object),
    }


def test_a_tree_does_not_differ_from_itself() -> None:
    assert differences(tree(), tree(), 0.0) == []


@pytest.mark.parametrize(
    ("group", "index", "value", "said"),
    [
        ("x", (0, 1), 2.5, "a/x[0, 1]: stored 2, computed 2.5 (may differ by 0.4)"),
        ("x", (1, 1), np.nan, "a/x[1, 1]: stored 4, computed nan (may differ by 0.4)"),
        ("x", (1, 0), 0.0, "a/x[1, 0]: stored nan, computed 0 (may differ by 0.4)"),
        ("n", (1,), 3, "a/n[1]: stored 2, computed 3"),
    ],
)
def test_what_differs_is_named(group: str, index: Any, value: Any, said: str) -> None:
    fresh = tree()
    fresh["a"][group][index] = value
    assert differences(tree(), fresh, 0.4) == [said]


def test_a_float_may_differ_by_what_is_allowed_and_no_more() -> None:
    fresh = tree()
    fresh["a"]["x"][0, 0] = 1.25
    assert differences(tree(), fresh, 0.25) == []
    assert differences(tree(), fresh, 0.24) != []


def test_a_text_that_changed_is_found() -> None:
    fresh = tree()
    fresh["b"][1] = "r"
    assert differences(tree(), fresh, 1.0) == ["b[1]: stored q, computed r"]


@pytest.mark.parametrize("missing_first", [True, False])
def test_a_missing_array_or_group_is_found(missing_first: bool) -> None:
    for remove, said in ((("a",), "a"), (("a", "n"), "a/n")):
        fewer = tree()
        holder: Any = fewer
        for name in remove[:-1]:
            holder = holder[name]
        del holder[remove[-1]]
        pair = (fewer, tree()) if missing_first else (tree(), fewer)
        where = "computed" if missing_first else "stored"
        assert differences(*pair, 0.0) == [f"{said} is only {where}"]


def test_another_shape_is_found() -> None:
    fresh = tree()
    fresh["b"] = fresh["b"][:1]
    assert differences(tree(), fresh, 0.0) == ["b: shape (2,) stored, (1,) computed"]


def test_a_group_for_an_array_is_found() -> None:
    group = {**tree(), "b": {"c": np.array([1])}}
    assert differences(tree(), group, 0.0) == ["b: shape (2,) stored, () computed"]
    assert differences(group, tree(), 0.0) == ["b: shape () stored, (2,) computed"]


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        ([0.1, 0.2], None),
        ([0.1, 0.3], "e[1]: 0.29999999999999999 is stated, at most 0.2 is declared"),
        ([0.5, 0.9], "e[0]: 0.5 is stated, at most 0.1 is declared"),
        ([np.nan, 0.9], "e[0]: nan is stated, at most 0.1 is declared"),
    ],
)
def test_an_error_beyond_what_is_declared_is_told(stated: list[float], said: str | None) -> None:
    found = beyond("e", np.array(stated), np.array([0.1, 0.2]))
    assert found == ([said] if said else [])


def test_where_nothing_is_declared_any_error_may_be_stated() -> None:
    assert beyond("e", np.array([np.nan, np.inf]), np.inf) == []


def test_a_difference_inside_a_group_keeps_its_parts() -> None:
    [found] = inside("g", [Difference("a", 1.5, 2.5, 0.25)])
    assert found == "g/a: stored 1.5, computed 2.5"
    assert (found.place, found.stored, found.computed, found.allowed) == ("g/a", 1.5, 2.5, 0.25)


def test_attributes_that_changed_came_or_went_are_told() -> None:
    found = attributes({"x": 1, "y": 2, "z": [1, 2]}, {"x": 1, "w": 3, "z": [1, 3]}, "p")
    assert found == [
        "p@y: stored 2, computed (absent)",
        "p@z: stored [1, 2], computed [1, 3]",
        "p@w: stored (absent), computed 3",
    ]


def outline(**root: Any) -> dict[str, Any]:
    given = {"engine": "taylor 1", "code_hash": "a", "tolerance": 1.0, **root}
    return {"/": given, "/data": {"units": "rad"}, "/provenance": {"processor": root}}


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({}, []),
        ({"engine": "taylor 2", "code_hash": "b", "reasons": ["new"]}, []),
        ({"tolerance": 2.0}, ["/@tolerance: stored 1, computed 2"]),
        ({"engine": "scipy 1", "tolerance": 2.0}, []),
        ({"figure": "4"}, ["/@figure: stored (absent), computed 4"]),
    ],
)
def test_an_outline_differs_in_what_a_result_consists_of(changed: Any, said: list[str]) -> None:
    assert outlines(outline(), outline(**changed)) == said


def test_an_outline_with_another_attribute_or_object_differs() -> None:
    other = {**outline(), "/data": {"units": "1"}, "/more": {}}
    assert outlines(outline(), other) == [
        "/more is only computed",
        "/data@units: stored rad, computed 1",
    ]


def test_plain_values_differ_where_they_do_in_order() -> None:
    stored = {"b": {"x": 1, "y": [1, 2]}, "a": 1, "c": 0}
    fresh = {"b": {"x": 2, "y": [1, 2]}, "a": 3}
    assert plain(stored, fresh, "config") == [
        "config/a: stored 1, computed 3",
        "config/b/x: stored 1, computed 2",
        "config/c is only stored",
    ]
    assert plain(stored, stored, "config") == []
    assert plain({"x": 1}, 1, "config") == ["config: stored {'x': 1}, computed 1"]
