"""Changes of a symbol: bisection by many phases at a time."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import pytest

from rigidpend import Body, route_codes
from rigidpend.numbers.exact import Exact, exact
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.routes import change
from rigidpend.routes.change import Bracket, NoChange, bisect, narrowed
from rigidpend.routes.problem import RouteProblem

BODY = Body(A=(2, 1, 1.5), r=(1, 1, 0), mu="0.001")
CHANGE = exact("0.7234567890123456789")


def threshold(phases: Sequence[Exact]) -> list[list[int]]:
    return [[1, int(float(x - CHANGE) > 0)] for x in phases]


@pytest.mark.parametrize("width", [0.3, 1e-3, 1e-17])
def test_every_half_holds_the_change_and_the_last_is_as_narrow_as_asked(width: float) -> None:
    path = bisect(threshold, Bracket(exact("0"), exact("1")), width)
    for whole, half in pairwise(path):
        assert half.width == whole.width / 2
        assert {half.low, half.high} & {whole.low, whole.high}
        assert float(half.low - CHANGE) <= 0 < float(half.high - CHANGE)
    assert path[-1].width <= width < path[-2].width


def test_irrational_ends_are_halved_too() -> None:
    path = bisect(threshold, Bracket(exact("pi/10"), exact("pi/3")), 1e-20)
    assert path[-1].low.fraction is not None
    assert 0 < path[-1].width <= 1e-20
    assert float(path[-1].low - CHANGE) <= 0 < float(path[-1].high - CHANGE)


@pytest.mark.parametrize("between", [("0", "0.5"), ("0.8", "1")])
def test_no_change_is_told_with_the_symbols(between: tuple[str, str]) -> None:
    with pytest.raises(NoChange, match=r"symbol 2 must change, and no other before it; it is \[1"):
        bisect(threshold, Bracket(*map(exact, between)), 1e-3)


def test_an_earlier_change_is_none() -> None:
    def both(phases: Sequence[Exact]) -> list[list[int]]:
        return [[side, side] for _, side in threshold(phases)]

    with pytest.raises(NoChange):
        bisect(both, Bracket(exact("0"), exact("1")), 1e-3)


def test_narrowing_ends_at_a_width_that_is_met_to_the_last_bit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(change, "_by_differences", lambda *_: threshold)
    told: list[float] = []

    def counted(width: float) -> None:
        told.append(width)
        assert len(told) < 9, "it goes on for ever"

    problem = RouteProblem(BODY, exact("1.3342"), exact("1e-8"), 2)
    path = narrowed(problem, Bracket(exact("0"), exact("1")), 2.0**-60, resolve(), counted)
    assert path[-1].width == 2.0**-60
    assert len(path) == 61


@pytest.mark.slow
@pytest.mark.parametrize("symbol", [1, 2])
def test_narrowed_ends_lie_on_both_sides_of_the_change(symbol: int) -> None:
    """Established by integration, at a distance of 1e-20."""
    asked = RouteProblem(BODY, exact("1.3342"), exact("1e-8"), symbol)

    def codes(phases: Sequence[Exact]) -> list[list[int]]:
        found = route_codes(
            BODY,
            phases,
            h0=asked.h0,
            J1_0=asked.J1_0,
            n_symbols=symbol,
            precisions=(53, 64, 113, 160),
            method="integration",
        )
        assert found.certain.all()
        return [list(map(int, column)) for column in found.codes.T]

    grid = [exact(f"{k}/100") for k in range(440, 500)]
    prefixes = codes(grid)
    k = next(k for k, (a, b) in enumerate(pairwise(prefixes)) if a[:-1] == b[:-1] and a != b)
    told: list[float] = []
    path = narrowed(asked, Bracket(grid[k], grid[k + 1]), 1e-20, resolve(), told.append)
    assert path[-1].width <= 1e-20
    assert told == sorted(told, reverse=True)
    assert codes(path[-1]) == [prefixes[k], prefixes[k + 1]]
