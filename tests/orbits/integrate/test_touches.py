"""Passages of M3 that nearly touch zero, or do: no crossing is lost, and none is guessed.

An orbit is placed beside a touch, M3 = depth and M3' = 0, and carried back by integers of 200
bits, from where every engine has to find what it does there.
"""

from __future__ import annotations

import functools
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics.equations import AlignedCoefficients, aligned, aligned_coefficients
from rigidpend.numbers.exact import context, fraction
from rigidpend.orbits.integrate import (
    Crossings,
    Orbits,
    Outcome,
    crossings,
)
from rigidpend.orbits.integrate.passages import zeros
from rigidpend.orbits.integrate.sections import first_crossings
from rigidpend.orbits.integrate.states import states_at

HEAVY = Body(A=(2, 1, "1.5"), r=(1, 3, 0), mu="0.4")
BITS = 240
BACK = 1.0
"""How long before the touch the orbits start, in t'; the next crossing comes much later."""


@functools.cache
def body(bits: int) -> AlignedCoefficients:
    m = context(BITS + 60)
    exactly = aligned_coefficients(HEAVY.angles(BITS + 60), m)
    return AlignedCoefficients(*(fraction(x, bits) for x in exactly))


def at_touch(depth: str) -> list[Fraction]:
    """A state with M3 = depth and M3' = 0."""
    c, P = body(53), BITS + 120
    gamma1, gamma2, gamma3 = Fraction("0.36"), Fraction("0.48"), Fraction("0.8")
    # Qp^2 - Qm^2 balances the weight.
    Qm = Fraction("0.9")
    square = Qm * Qm - (c.mu_r2 * gamma1 - c.mu_r1 * gamma2) / c.twist
    m = context(P)
    root = m.sqrt(m.mpf(square.numerator) / square.denominator)
    Qp = Fraction(int(root * 2**P), 2**P)
    return [Qp, Qm, Fraction(depth), gamma1, gamma2, gamma3]


def sign_of_bend() -> float:
    """The sign of M3'' at the touch."""
    c, state = AlignedCoefficients(*map(float, body(53))), np.array(at_touch("0"), dtype=float)
    return float(np.sign(aligned(state + 1e-6 * np.array(aligned(state, c)), c)[2]))


@functools.cache
def before_touch(depth: str) -> tuple[Fraction, ...]:
    """The state of the same orbit at -BACK."""
    state = np.array([at_touch(depth)]).T
    return tuple(states_at(body(53), state, [Fraction(-BACK)], 2 * BITS)[:, 0, 0])


@functools.cache
def found(depth: str, bits: int, wanted: int = 2, limit: float = 2 * BACK) -> Crossings:
    states: Any = [before_touch(depth)]
    c: Any = body(53)
    if bits == 53:
        states = np.array(states, dtype=float).T
        c = AlignedCoefficients(*map(float, c))
    engine = "taylor" if bits in (53, 64, 106, 113, 160) else "scipy"
    return crossings(
        Orbits(c, states, wanted, limit),
        engine=engine,
        bits=bits if engine == "taylor" else 200,
        tolerance=2.0**-52,
        jobs=1,
    )


@pytest.mark.slow
@pytest.mark.parametrize("bits", [53, 64, 106, 113, 160])
@pytest.mark.parametrize("size", ["1e-2", "1e-3", "1e-4"])
def test_a_pair_of_crossings_beside_a_touch_is_found_and_none_where_it_misses(
    bits: int, size: str
) -> None:
    bend = sign_of_bend()
    through, clear = (size, f"-{size}") if bend < 0 else (f"-{size}", size)
    pair, truth = found(through, bits), found(through, 200)
    assert pair.outcome.tolist() == [Outcome.COMPLETE]
    np.testing.assert_allclose(pair.time, truth.time, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(pair.separatrix, truth.separatrix)
    assert pair.time[0] < BACK < pair.time[1], "one on either side of the touch"
    missed = found(clear, bits)
    assert missed.outcome.tolist() == [Outcome.NO_CROSSING]
    assert np.isnan(missed.time).all()


@pytest.mark.parametrize("depth", ["0", "1e-6", "-1e-6", "1e-12", "-1e-12"])
@pytest.mark.parametrize("bits", [53, 64])
def test_what_doubles_cannot_decide_they_leave_to_higher_precision(depth: str, bits: int) -> None:
    undecided = found(depth, bits)
    assert undecided.outcome.tolist() == [Outcome.FAILED]
    assert np.isnan(undecided.time[1]), "the crossing behind, without which no symbol is certain"


@pytest.mark.slow
@pytest.mark.parametrize("depth", ["1e-6", "-1e-6", "1e-12", "-1e-12", "1e-18", "-1e-18"])
@pytest.mark.parametrize("bits", [113, 200])
def test_more_bits_decide_what_doubles_leave(depth: str, bits: int) -> None:
    fine = found(depth, bits)
    crossed = (float(depth) > 0) == (sign_of_bend() < 0)
    assert fine.outcome.tolist() == [Outcome.COMPLETE if crossed else Outcome.NO_CROSSING]


@pytest.mark.parametrize("bits", [106, 113, 200])
def test_a_touch_itself_is_undecided_in_every_precision(bits: int) -> None:
    assert found("0", bits).outcome.tolist() == [Outcome.FAILED]


@pytest.mark.parametrize(("engine", "bits"), [("taylor", 106), ("scipy", 113)])
def test_a_first_crossing_that_is_not_decided_is_none(engine: str, bits: int) -> None:
    given: dict[str, Any] = {"engine": engine, "bits": bits, "tolerance": 2.0**-52, "jobs": 1}
    assert first_crossings(body(53), [before_touch("0")], 2 * BACK, **given) == [None]


@pytest.mark.parametrize(
    ("coefficients", "expected"),
    [
        ([-0.25, 1.0], [0.25]),
        ([0.09, -0.6, 1.0 - 1e-3], "two"),
        ([0.09 + 1e-3, -0.6, 1.0], []),
        ([-1.0, 1.0], [1.0]),
        ([0.0, 1.0], []),
        ([-6 / 64, 11 / 16, -6 / 4, 1.0], [0.25, 0.5, 0.75]),
    ],
)
def test_zeros_are_isolated(coefficients: list[float], expected: Any) -> None:
    found = list(zeros(coefficients, 1e-9))
    assert all(decided for _, decided in found)
    there = [at for at, _ in found]
    if expected == "two":
        roots = np.sort(np.roots(coefficients[::-1]).real)
        np.testing.assert_allclose(there, roots, atol=1e-9)
    else:
        np.testing.assert_allclose(there, expected, atol=1e-12)


def test_a_double_zero_is_told() -> None:
    at, decided = next(zeros([0.09, -0.6, 1.0], 1e-9))
    assert not decided
    assert at == pytest.approx(0.3, abs=1e-3)


def test_where_no_turn_lies_between_the_middle_is_told() -> None:
    """A pair of zeros nearer than a millionth, whose slope no bisection tells from zero."""
    assert next(zeros([0.0] * 3 + [1e-30], 1e-9)) == (2.0**-21, False)
