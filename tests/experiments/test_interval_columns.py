"""Single starts beside the intervals that they lie on."""

from __future__ import annotations

from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.route_intervals import compute
from rigidpend.experiments.route_intervals.compute import contradictions
from rigidpend.numbers.expressions import NO_SYMBOL
from rigidpend.routes.certified.checker import Undecided
from tests.experiments.trees import reference

# The quarters of the line: two symbols are proven on the first, one on the third.
INTERVALS = {
    "place": np.array([0, 2]),
    "depth": np.array([2, 2]),
    "codes": np.array([[0, 1], [1, NO_SYMBOL]], dtype=np.uint8),
}
QUARTER = np.pi / 2


@pytest.mark.parametrize(
    ("phase", "code", "told"),
    [
        (0.0, [0, 1, 1], True),
        (0.0, [0, 0, 1], False),
        (0.99 * QUARTER, [1, 1, 0], False),
        (1.01 * QUARTER, [1, 1, 0], True),
        (2.01 * QUARTER, [1, 0, 0], True),
        (2.99 * QUARTER, [0, 1, 0], False),
        (3.01 * QUARTER, [0, 0, 0], True),
        (4.01 * QUARTER, [1, 1, 1], False),
        (-0.01 * QUARTER, [1, 1, 1], True),
    ],
)
def test_a_column_has_the_symbols_of_its_interval(
    phase: float, code: list[int], told: bool
) -> None:
    columns = {
        "theta2_0": np.array([3.1 * QUARTER, phase]),
        "codes": np.array([[0, x] for x in code], dtype=np.uint8),
        "certain": np.ones((3, 2), dtype=bool),
    }
    assert contradictions(INTERVALS, columns) == ([] if told else [phase])
    # What is uncertain contradicts nothing.
    columns["certain"][:] = False
    assert contradictions(INTERVALS, columns) == []


def test_an_interval_that_is_not_proven_again_is_in_no_theorem(monkeypatch: Any) -> None:
    def doubted(part: Any, _: Any) -> None:
        raise Undecided(f"the interval {part}")

    monkeypatch.setattr(compute, "arranged", lambda *_: (["0/2^1"], [Fraction(1, 2)]))
    config: Any = SimpleNamespace(problem=None)
    monkeypatch.setattr(compute, "_again", lambda *_: None)
    assert compute.theorems(config, {}) == [
        "1 symbol, the same on each interval, of all starts on 1/2 of the line, 0.5"
    ]
    monkeypatch.setattr(compute, "_again", doubted)
    with pytest.raises(ArithmeticError, match=r"the interval 0/2\^1"):
        compute.theorems(config, {})


def test_a_run_ends_with_an_error_where_a_column_is_another(monkeypatch: Any) -> None:
    data = reference("fig4_intervals")["data"]
    parts = [{"intervals": data["intervals"], "proof": data["proof"]}]
    config: Any = SimpleNamespace(problem=None)
    means: Any = SimpleNamespace(report=print, jobs=1)
    columns = dict(data["columns"])
    monkeypatch.setattr(compute, "_columns", lambda *_: columns)
    compute._joined(config, parts, means)
    columns["codes"] = columns["codes"].copy()
    columns["codes"][1, 30] ^= 1
    with pytest.raises(ArithmeticError, match=r"others than those of theta2_0 = \[3\.0"):
        compute._joined(config, parts, means)
