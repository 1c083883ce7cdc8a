"""A lie would be found."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend import integrate
from rigidpend.measure.stress import honesty
from rigidpend.routes import RouteCodes, certainty, route_codes
from tests.integrate.problems import FIG4, needs_heyoka


def run(orbits: int) -> Any:
    return honesty.block(
        FIG4,
        "1.3342",
        "1e-8",
        ("1e-2", "1e-4"),
        orbits=orbits,
        n_symbols=15,
        seed=5,
        engine=integrate.default_engine(),
        jobs=1,
    )


def verdicts(tree: Any) -> list[str]:
    return [str(case["verdict"].values) for case in tree["cases"].values()]


def test_wrong_symbols_come_and_none_is_called_certain() -> None:
    made = run(300)
    assert (made["curves"]["wrong"].values > 0).all()
    assert made["curves"]["symbols"].values.tolist() == [300 * 15] * 2
    assert verdicts(made) == ["passed"] * 3


def test_a_computation_that_is_always_sure_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    def sure(*given: Any, **named: Any) -> RouteCodes:
        made = route_codes(*given, **named)
        return made._replace(certain=np.ones_like(made.certain))

    monkeypatch.setattr(honesty, "route_codes", sure)
    made = run(300)
    assert verdicts(made) == ["FAILED", "FAILED", "passed"]
    assert np.array_equal(made["curves"]["lies"].values, made["curves"]["wrong"].values)


@needs_heyoka
def test_the_hard_orbit_tells_where_a_computation_is_compared_with_itself(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert verdicts(honesty.hard_orbit("taylor")) == ["passed"]
    monkeypatch.setattr(certainty, "SECOND", certainty.FIRST)
    assert verdicts(honesty.hard_orbit("taylor")) == ["FAILED"]


def test_counts() -> None:
    def record(codes: list[int], certain: list[int]) -> RouteCodes:
        empty = np.empty(0)
        shaped = np.array([codes], dtype=np.uint8), np.array([certain], dtype=bool)
        bits, nothing = empty.astype(np.uint16), empty.astype(bool)
        return RouteCodes(empty, *shaped, bits, empty, empty.astype(np.uint8), nothing)

    spoilt = record([0, 1, 1, 0, 1], [1, 1, 0, 0, 1])
    true = record([0, 0, 0, 0, 0], [1, 1, 1, 1, 0])
    assert honesty.counted(spoilt, true).tolist() == [4, 2, 1]
