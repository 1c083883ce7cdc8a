"""Comparing two results by what their layout declares: doubles within bounds, all else exactly."""

import functools
import operator
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.compare import differences, modulo, of_largest, relative, stated
from rigidpend.experiments.data import ANY, FLOAT, TEXT, WHOLE, Field, Layout, held

LAYOUT: Layout = {
    "a": {
        "x": Field(FLOAT, (2, 2), gaps=True, within=0.4),
        "n": Field(WHOLE, (2,)),
        "how": Field(WHOLE, within=ANY),
        "e": Field(FLOAT, (2,), within=stated(0.2)),
        # Infinite, so that nothing is compared, where a fresh result states none.
        "s": Field(
            FLOAT, (2,), within=stated(lambda name, _, x: np.where(x[name] == x[name], 0.2, np.inf))
        ),
        "r": Field(FLOAT, (2,), within=relative(0.1)),
        "m": Field(FLOAT, (2,), within=of_largest(0.1)),
        "l": Field(FLOAT, (2,), within=of_largest(0.1, least=10.0)),
        "f": Field(FLOAT, (2,), within=relative(0.1, to="scale")),
        "p": Field(FLOAT, (2,), within=modulo(4.0, lambda name, stored, fresh: 0.1)),
        "c": Field(WHOLE, (2,), within=lambda name, stored, fresh: np.array([0, np.inf])),
    },
    "b": Field(TEXT, (2,)),
    "scale": Field(FLOAT),
    "of": {"<any>": {"y": Field(FLOAT)}},
}


def tree() -> dict[str, Any]:
    two = np.array([1.0, -4.0])
    return {
        "a": {
            "x": np.array([[1.0, 2.0], [np.nan, 4.0]]),
            "n": np.array([1, 2]),
            "how": np.array(1),
            "e": np.array([0.1, np.nan]),
            "s": np.array([0.1, 0.1]),
            **{name: two.copy() for name in "rmlfp"},
            "c": np.array([1, 2]),
        },
        "b": np.array(["p", "q"], dtype=object),
        "scale": np.array(-10.0),
        "of": {"one": {"y": np.array(1.0)}},
    }


@pytest.mark.parametrize(
    ("name", "index", "value", "said"),
    [
        ("x", (0, 1), 2.5, "a/x[0, 1]: stored 2, computed 2.5 (may differ by 0.4)"),
        ("x", (0, 1), 2.375, None),
        ("x", (1, 1), np.nan, "a/x[1, 1]: stored 4, computed nan (may differ by 0.4)"),
        ("x", (1, 0), 0.0, "a/x[1, 0]: stored nan, computed 0 (may differ by 0.4)"),
        ("n", (1,), 3, "a/n[1]: stored 2, computed 3"),
        ("how", (), 2, None),
        ("e", (0,), 0.19, None),
        ("e", (0,), -0.25, "a/e[0]: 0.25 is stated, at most 0.2 is declared"),
        ("e", (0,), np.nan, "a/e[0]: stored True, computed False"),
        ("e", (1,), 0.1, "a/e[1]: stored False, computed True"),
        ("e", (1,), np.inf, "a/e[1]: stored False, computed True"),
        ("s", (0,), np.nan, None),
        ("s", (1,), 0.25, "a/s[1]: 0.25 is stated, at most 0.2 is declared"),
        ("r", (0,), 1.0625, None),
        ("r", (0,), 1.25, "a/r[0]: stored 1, computed 1.25 (may differ by 0.1)"),
        ("r", (1,), -4.25, None),
        ("r", (1,), -4.5, "a/r[1]: stored -4, computed -4.5 (may differ by 0.4)"),
        ("m", (0,), 1.25, None),
        ("m", (0,), 1.5, "a/m[0]: stored 1, computed 1.5 (may differ by 0.4)"),
        ("l", (0,), 1.75, None),
        ("l", (0,), 2.25, "a/l[0]: stored 1, computed 2.25 (may differ by 1)"),
        ("f", (0,), 1.75, None),
        ("f", (0,), 2.25, "a/f[0]: stored 1, computed 2.25 (may differ by 1)"),
        ("p", (1,), 0.0625, None),
        ("p", (1,), 0.25, "a/p[1]: stored -4, computed -3.75 (may differ by 0.1)"),
        ("c", (0,), 2, "a/c[0]: stored 1, computed 2"),
        ("c", (1,), 3, None),
    ],
)
def test_what_differs_by_more_than_is_declared_is_named(
    name: str, index: Any, value: Any, said: str | None
) -> None:
    fresh = tree()
    fresh["a"][name][index] = value
    assert differences(LAYOUT, tree(), fresh) == ([said] if said else [])


@pytest.mark.parametrize(("name", "most"), [("e", "0.2"), ("own", "4")])
def test_a_stored_error_is_no_larger_than_is_declared(name: str, most: str) -> None:
    """An error may also widen the bound that follows from it."""
    layout = {
        "e": Field(FLOAT, (2,), within=stated(0.2)),
        "own": Field(FLOAT, (2,), within=stated(of_largest(4))),
    }
    fresh = {key: np.array([0.1, 1.0 if key == "own" else np.nan]) for key in layout}
    stored = {key: x.copy() for key, x in fresh.items()}
    stored[name][0] = 0.99 * float(most)
    assert not differences(layout, stored, fresh)
    stored[name][0] = -1.01 * float(most)
    said = f"{name}[0]: stored {1.01 * float(most):.17g} is stated, at most {most} is declared"
    assert differences(layout, stored, fresh) == [said]


def test_the_bound_of_a_layout_is_that_of_all_doubles_which_declare_none() -> None:
    """In a group inside a group too, and of nothing but doubles."""
    found: Any = held(0.5, LAYOUT)
    assert [found["scale"].within, found["of"]["<any>"]["y"].within] == [0.5, 0.5]
    assert {name: x for name, x in found["a"].items() if x.within != 0.5} == LAYOUT["a"]
    assert found["b"] == LAYOUT["b"]


def test_a_text_that_changed_and_another_shape_are_found() -> None:
    fresh = tree()
    fresh["b"][1] = "r"
    # An angle that would fit as well in every place.
    fresh["a"]["p"] = fresh["a"]["p"][:1]
    told = ["a/p: shape (2,) stored, (1,) computed", "b[1]: stored q, computed r"]
    assert differences(LAYOUT, tree(), fresh) == told
    fresh = tree() | {"b": fresh["b"][:1]}
    assert differences(LAYOUT, tree(), fresh) == ["b: shape (2,) stored, (1,) computed"]


def test_a_fresh_result_widens_no_bound_by_another_field() -> None:
    fresh = tree() | {"scale": np.array(100.0)}
    fresh["a"]["f"][0] = 2.25
    places = [found.place for found in differences(LAYOUT, tree(), fresh)]
    assert places == ["a/f[0]", "scale"]


def test_the_worst_difference_is_that_furthest_beyond_its_bound() -> None:
    fresh = tree()
    fresh["a"]["r"] += [0.3, 0.9]
    [found] = differences(LAYOUT, tree(), fresh)
    assert (found.place, found.stored, found.computed) == ("a/r[0]", 1.0, 1.3)
    assert found.allowed == pytest.approx(0.1, rel=1e-15, abs=0)
    assert found.endswith("(may differ by 0.1, 2 of 2 differ)")


@pytest.mark.parametrize("place", ["a", "a/n", "of/one", "b", "a/how"])
def test_a_missing_array_or_group_is_found_but_none_that_is_not_compared(place: str) -> None:
    fewer, (*outer, name) = tree(), place.split("/")
    del functools.reduce(operator.getitem, outer, fewer)[name]
    compared = name != "how"
    assert differences(LAYOUT, fewer, tree()) == [f"{place} is only computed"] * compared
    assert differences(LAYOUT, tree(), fewer) == [f"{place} is only stored"] * compared
