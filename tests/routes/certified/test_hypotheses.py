"""Each hypothesis of the theorem, barely true and barely false, for both checkers.

Where the limit lies is computed here, in doubles, from docs/certified.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import pytest

from rigidpend.routes.certified import approximation
from rigidpend.routes.certified.pieces import Step
from tests.routes.certified.offered import GIVEN, Start, by_package, by_script, said

BITS = 60
WIDEST = 2.0**-6
"""Radius of a tube at most."""
BARELY, NEARLY = 0.005, 0.02
"""Shares of a limit; the latter where a checker's parts are too coarse for the former."""


def step_of(start: Start, away: float, half: float) -> Step:
    """A step along the orbit that starts so far from the true one, in Qm."""
    orbit = start.approximation(BITS, Qm=away)
    orbit.longest = 2 * half
    return orbit.step(BITS)


def of_intervals(start: Start, steps: Sequence[Step]) -> list[str]:
    """The reasons for which both prove no more of an interval of starts."""
    return [said(start.signs, steps), said(start.signs_by_script, steps)]


def joint(times: float) -> tuple[Start, Step]:
    """H1: the first polynomial begins so far from the orbit, for the widest tube."""
    return Start(), step_of(Start(), times * WIDEST, 2.0**-12)


def flaw(times: float) -> tuple[Start, Step]:
    """H2: c (T_2 - 1), which vanishes at both ends, has the derivative 4 c T_1."""
    step = step_of(Start(), 0.0, 2.0**-12)
    series = [list(row) for row in step.series]
    c = round(times * WIDEST / 8 * 2**BITS)
    series[0][2] += c
    series[0][0] -= 2 * c
    return Start(), step._replace(series=series)


def tube(times: float) -> tuple[Start, Step]:
    """H3: what the distance grows to over half a unit of time, for the widest tube."""
    start, half = Start(), 0.25
    sine, size = 2 * math.sqrt(2) / 3, math.sqrt(2 * 1.3342 / (4 / 3))
    lam, sigma = sine / 2, sine / math.sqrt(2)
    # Beside the lower orbit |M3| = |M|, but for the little that the weight changes.
    l = lam * (size + WIDEST / (2 * sigma))
    cosine, sin = math.sqrt(1 / 3), math.sqrt(2 / 3)
    F = 1e-3
    Omega = max(
        math.sqrt(2) * (4 / 3 - cosine**2) / (2 * cosine),
        math.sqrt(2) * (4 / 3 + sin**2) / (2 * sin),
        4 / 3 / sigma,
    )
    w = math.sqrt(Omega / F)
    k = w * F + (1 + w * WIDEST / 2) * Omega / w
    rate = (l + math.hypot(l, k)) / 2
    return start, step_of(start, times * WIDEST / math.exp(2 * half * rate), half)


def sign(times: float) -> tuple[Start, Step]:
    """H4: M3 = 2 J1 - J2 at the start, and hardly changed by the end of a short step."""
    start = Start(J1_0="7/10")
    M3 = 1.4 - math.sqrt(2 * 1.3342 / (4 / 3))
    # sigma = sin(alpha0)/sqrt(2) = 2/3.
    return start, step_of(start, times * abs(M3) * 2 / 3, 2.0**-16)


def slope(times: float) -> tuple[Start, Step]:
    """H5: M3 rises through zero at the rate Qp^2/(4 lambda), and Qm is small."""
    A3, h0, half = 1.0117, 1.09, 0.45
    kappa, s2 = 2 / A3, 2 * (A3 - 1) / A3
    sine, J2 = 2 * math.sqrt(s2 * (1 - s2)), math.sqrt(2 * h0 / kappa)
    rate = J2**2 * sine / 2
    J1 = (J2 - half * rate) / 2
    start = Start(("2", "1", str(A3)), GIVEN["r"], "1e-9", str(h0), repr(J1))
    # rate = (2 |Qp| + 2 B) B/(4 lambda) + B/(sigma tau), for a weight of nearly nothing.
    B = 0.01
    for _ in range(50):
        B = rate / ((2 * J2 * sine + 4 * B) / (2 * sine) + math.sqrt(2) / (sine * half))
    # Until then the distance grows by the lemma; with no weight w is large, and k is E Omega/2.
    lam, sigma = sine / 2, sine / math.sqrt(2)
    l = lam * (half * rate / 2 + WIDEST / (2 * sigma))
    k = WIDEST / 2 * kappa / sigma
    grown = math.exp(half * (l + math.hypot(l, k)))
    return start, step_of(start, times * B / grown, half)


def test_a_step_of_an_interval_goes_forward() -> None:
    step = step_of(Start(), 0.0, 2.0**-12)
    for length, reason in ((step.half_length, ""), (0, "H2: "), (-step.half_length, "H2: ")):
        found = of_intervals(Start(), [step._replace(half_length=length)])
        assert [each[:4] for each in found] == [reason] * 2


@pytest.mark.parametrize(
    ("name", "made", "barely"),
    [
        ("H1", joint, BARELY / 10),
        ("H2", flaw, BARELY / 10),
        # So near that growth is told at half of the tube's radius, of intervals at a quarter.
        ("H3", tube, BARELY / 10),
        ("H4", sign, BARELY),
        ("H5", slope, NEARLY),
    ],
)
def test_what_is_barely_true_passes_and_what_is_barely_false_is_named(
    name: str,
    made: Callable[[float], tuple[Start, Step]],
    barely: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of an interval of starts, before any crossing, all three show in the tube."""
    # Steps may end where the prover would not end them.
    monkeypatch.setattr(approximation, "CLEAR", 0.0)
    for times in (1 - barely, 1 + barely):
        start, step = made(times)
        for checker in (by_package, by_script):
            found = checker(start, [step])
            assert f"{name}: " in found if times > 1 else "H" not in found, checker
        if made in (joint, flaw, tube):
            expected = ["H3: " if times > 1 else ""] * 2
            assert [found[:4] for found in of_intervals(start, [step])] == expected
