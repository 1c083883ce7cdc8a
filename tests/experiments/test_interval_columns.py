"""Single starts beside the intervals that they lie on."""

from __future__ import annotations

from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.route_intervals import compute
from rigidpend.experiments.route_intervals.compute import contradictions
from rigidpend.numbers.exact import exact, exacts
from rigidpend.numbers.expressions import NO_SYMBOL
from rigidpend.routes.certified.checker import Undecided
from tests.experiments.trees import reference

# The quarters of the line: two symbols are proven on the first, one on the third.
INTERVALS = {
    "place": np.array([0, 2]),
    "depth": np.array([2, 2]),
    "codes": np.array([[0, 1], [1, NO_SYMBOL]], dtype=np.uint8),
}
CASES = [
    ("0.99", [1, 1, 0], False),
    ("0.99", [0], True),
    ("0.99", [0, 0, 1], False),
    ("1.01", [1, 1, 0], True),
    ("1.99", [1], True),
    ("2.01", [1, 0, 0], True),
    ("2.01", [0], False),
    ("2.99", [0, 1, 0], False),
    ("3.01", [0, 0, 0], True),
]
"""In quarters of the line, a column's code, and whether it agrees with the intervals."""


@pytest.mark.parametrize(
    ("turns", "within", "code", "told"),
    [
        (0, "0", [0, 1, 1], True),
        (0, "0", [0, 0, 1], False),
        (0, "4.01", [1, 1, 1], False),
        (0, "-0.01", [1, 1, 1], True),
        *((n, *case) for n in (0, 10**9, 10**17, 10**30, -(10**30)) for case in CASES),
    ],
)
def test_a_column_has_the_symbols_of_the_interval_of_its_exact_phase(
    turns: int, within: str, code: list[int], told: bool
) -> None:
    """Beyond 1e15 rad the nearest double is further from a phase than an interval is long."""
    phases = [exact("3.1*pi/2"), exact(f"{turns}*2*pi + {within}*pi/2")]
    columns = {
        "theta2_0": np.array([float(x) for x in phases]),
        "codes": np.array([[0, x] for x in code], dtype=np.uint8),
        "certain": np.ones((len(code), 2), dtype=bool),
    }
    wrong = [] if told else [float(phases[1])]
    assert contradictions(INTERVALS, phases, columns) == wrong
    # What is uncertain contradicts nothing.
    columns["certain"][:] = False
    assert contradictions(INTERVALS, phases, columns) == []


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
    grid = SimpleNamespace(phases=exacts(data["columns"]["theta2_0"]))
    config: Any = SimpleNamespace(problem=SimpleNamespace(columns=grid))
    means: Any = SimpleNamespace(report=print, jobs=1)
    columns = dict(data["columns"])
    monkeypatch.setattr(compute, "_columns", lambda *_: columns)
    compute._joined(config, parts, means)
    columns["codes"] = columns["codes"].copy()
    columns["codes"][1, 30] ^= 1
    with pytest.raises(ArithmeticError, match=r"others than those of theta2_0 = \[3\.0"):
        compute._joined(config, parts, means)
