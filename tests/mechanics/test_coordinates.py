"""Maps between descriptions of a state: geometry, brackets, round trips, degenerate states."""

import math
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics import coordinates as co
from rigidpend.mechanics.coordinates import Andoyer, Canonical
from rigidpend.mechanics.equations import cross
from tests.bodies import THIN
from tests.strategies import (
    DERIVATIVE,
    FINE,
    ROUNDING,
    along,
    apart,
    assert_same_canonical,
    assert_same_state,
    bodies,
    canonicals,
    examples,
    jacobian,
    largest_difference,
    numbers,
    slight,
)

AXES = ((1, 0, 0), (0, 1, 0), (0, 0, 1))


def andoyer(G: Any, L: Any, H: Any, g: Any, l: Any, h: Any = 0.0) -> Andoyer:
    """Andoyer variables from the six alone, with cos p and cos q as they tell."""
    cosp, cosq = (np.sqrt((G - x) * (G + x)) / G for x in (L, H))
    return Andoyer(G, L, H, g, l, h, cosp, cosq)


def fine_state(x: Any) -> list[Any]:
    """M and gamma in 60 digits from G, L, H, g, l."""
    G, L, H, g, l = x
    turns = [(FINE.sin(angle), FINE.cos(angle)) for angle in (g, l)]
    p, q = ((y / G, FINE.sqrt(1 - (y / G) ** 2)) for y in (L, H))
    return [*co.momentum(G, *p, *turns[1]), *co.vertical(p, q, *turns)]


def brackets(c: Canonical) -> tuple[list[Any], Any]:
    """M and gamma with their Poisson brackets, (l, L) and (g, G) being conjugate."""
    a = co.andoyer_from_canonical(c, 0.7)
    x = [FINE.mpf(float(y)) for y in (a.G, a.L, a.H, a.g, a.l)]
    G, L, _, g, l = jacobian(fine_state, x).T
    return fine_state(x), np.outer(g, G) - np.outer(G, g) + np.outer(l, L) - np.outer(L, l)


@examples(6, canonicals())
def test_eq_depri_G_turns_the_momentum_by_its_own_brackets(c: Canonical) -> None:
    state, found = brackets(c)
    # {x, M_j} is the rate of x in a turn about axis j.
    for j, axis in enumerate(AXES):
        assert largest_difference(found[:3, j], cross(state[:3], axis)) < DERIVATIVE


@examples(6, canonicals())
def test_eq_depri_g_leans_by_q_and_turns_by_g_from_the_momentum(c: Canonical) -> None:
    a = co.andoyer_from_canonical(c, 0.7)
    G, L, H, g, l = (FINE.mpf(float(y)) for y in (a.G, a.L, a.H, a.g, a.l))
    sinp, sinq = L / G, H / G

    def direction(x: Any) -> Any:
        (sinp, sinl), (cosp, cosl) = map(FINE.sin, x), map(FINE.cos, x)
        return co.momentum(1, sinp, cosp, sinl, cosl)

    at = [FINE.asin(sinp), l]
    rise, turn = along(direction, at, [1, 0]), along(direction, at, [0, 1 / FINE.cos(at[0])])
    cosq = FINE.sqrt(1 - sinq**2)
    expected = [
        sinq * m + cosq * (FINE.sin(g) * t - FINE.cos(g) * r)
        for m, t, r in zip(direction(at), turn, rise, strict=True)
    ]
    assert largest_difference(fine_state([G, L, H, g, l])[3:], expected) < DERIVATIVE


@pytest.mark.parametrize(("l", "g"), [(0.4, 0.7), (2.0, 0.7), (0.4, 2.5), (3.5, 4.0), (5.9, 5.9)])
def test_eq_gamma_dep_holds_in_every_quadrant_where_the_printed_form_does_not(
    l: float, g: float
) -> None:
    M, gamma = co.body_from_andoyer(andoyer(2.0, 0.5, -0.3, g, l))
    found = co.andoyer_from_body(M, gamma)
    assert apart(found.l, l, co.TURN) <= ROUNDING
    assert apart(found.g, g, co.TURN) <= ROUNDING
    # As the paper prints it, with arcsin and arctan.
    across, slant = np.hypot(M[0], M[1]), np.linalg.norm(np.cross(M, gamma))
    sing = (M[1] * gamma[0] - M[0] * gamma[1]) / across * np.linalg.norm(M) / slant
    printed = found._replace(g=np.arcsin(sing), l=np.arctan(M[0] / M[1]))
    assert abs(sing - math.sin(g)) <= ROUNDING
    right = math.cos(g) > 0 and math.cos(l) > 0
    error = largest_difference(co.body_from_andoyer(printed), (M, gamma))
    assert error <= ROUNDING if right else error > 0.5


@pytest.mark.slow
@examples(8, slight(), bodies())
def test_agrees_canonical_to_andoyer_and_to_aligned_and_back(c: Canonical, body: Body) -> None:
    alpha0, beta0 = body.alpha0, body.beta0
    found = co.canonical_from_andoyer(co.andoyer_from_canonical(c, beta0), beta0)
    assert_same_canonical(found, c)
    assert (found.J3, found.cosq, found.theta3) == (c.J3, c.cosq, c.theta3)
    assert 0 <= found.theta1 < 4 * np.pi
    assert 0 <= found.theta2 < 2 * np.pi
    found = co.canonical_from_aligned(co.aligned_from_canonical(c, alpha0, beta0), alpha0, beta0)
    # M1 and M2 lose what Qp and Qm have in common.
    assert_same_canonical(found, c, 1 / min(math.sin(alpha0 / 2), math.cos(alpha0 / 2)))


@examples(8, numbers(0.1, 1), numbers(0.1, 1), numbers(3, 6), numbers(3, 6), numbers(0, math.pi))
def test_eq_canon_keeps_the_form_L_dl_G_dg_H_dh(
    l: float, l_end: float, g: float, g_end: float, beta0: float
) -> None:
    # Both maps of angles are affine, so the form over a finite step is exact. No angle wraps.
    begin = co.canonical_from_andoyer(andoyer(2.0, 0.6, -1.1, g, l, 0.2), beta0)
    end = co.canonical_from_andoyer(andoyer(2.0, 0.6, -1.1, g_end, l_end, 0.9), beta0)
    before = 0.6 * (l_end - l) + 2.0 * (g_end - g) - 1.1 * (0.9 - 0.2)
    J = (begin.J1, begin.J2, begin.J3)
    after = sum(x * (b - a) for x, a, b in zip(J, begin[3:6], end[3:6], strict=True))
    assert after == pytest.approx(before, abs=20 * ROUNDING)


DEGENERATE: dict[str, Any] = {
    "up": ((0, 0, 2), (0.6, 0, 0.8)),
    "down": ((0, 0, -2), (0.48, 0.64, -0.6)),
    "negative zeros": ((-0.0, -0.0, -2), (-0.6, -0.0, 0.8)),
    "up, along gamma": ((0, 0, 2), (0, 0, 1)),
    "down, along gamma": ((0, 0, -2), (0, 0, -1)),
    "at rest": ((0, 0, 0), (0.48, 0.64, -0.6)),
    "at rest, gamma down": ((0, 0, 0), (0, 0, -1)),
    "along gamma, down": ((-1.2, 0, -1.6), (-0.6, 0, -0.8)),
    "against gamma": ((-0.6, -0.8, 0), (0.6, 0.8, 0)),
    "on axis 2": ((0, -1, 0), (0, 0, 1)),
    "nearly up": ((1e-140, 0, 2), (0.6, 0, 0.8)),
    "nearly at rest": ((3e-200, 4e-200, 1e-200), (0.48, 0.64, -0.6)),
}


@pytest.mark.parametrize(("M", "gamma"), DEGENERATE.values(), ids=DEGENERATE)
def test_agrees_degenerate_states_with_themselves(M: Any, gamma: Any) -> None:
    M, gamma, beta0 = np.array(M, dtype=float), np.array(gamma, dtype=float), 1.1
    a = co.andoyer_from_body(M, gamma)
    c = co.canonical_from_andoyer(a, beta0)
    assert np.isfinite([*a, *c]).all()
    assert_same_state(co.body_from_andoyer(a), M, gamma)
    assert_same_state(co.body_from_andoyer(co.andoyer_from_canonical(c, beta0)), M, gamma)
    assert (a.h, c.theta3) == (0, 0)
    if abs(M @ gamma) == np.linalg.norm(M) > 0:
        assert a.cosq < 1e-16
        assert a.g == 0
    if not M[:2].any():
        # Documented values.
        assert (a.G, a.L, a.l, a.cosp) == (abs(M[2]), M[2], 0, 0)
        assert (c.J1, c.J2mJ1, c.theta1) == (max(M[2], 0), max(-M[2], 0), beta0)
        assert abs(gamma[2]) < 1 or (a.g, a.cosq) == (0, 0)
        assert any(M) or float(a.H) == gamma[2]


def test_vectors_count_as_parallel_within_rounding_and_not_beyond() -> None:
    """The sine of their angle has two roundings: of the components, and of their differences."""
    vectors = np.random.default_rng(1).normal(size=(3, 10_000))
    gamma = vectors / np.linalg.norm(vectors, axis=0)
    for M in (3 * gamma, -0.7 * gamma):
        assert not co.andoyer_from_body(M, gamma).g.any()
    assert co.andoyer_from_body((0, 0, 2), (3 * np.finfo(float).eps, 0, 1)).g == math.pi / 2


def test_momenta_of_a_thin_body_keep_their_digits() -> None:
    """cos(alpha0/2) = A2/A3 there; by alpha0 in doubles it errs by 1e-8."""
    aligned = co.Aligned(1e-9, 2e-9, 0.5, 0.0, 0.0, 0.0)
    cos = float(FINE.mpf("1e-8") / (1 - FINE.mpf("1e-8")))
    M1, off = (
        co.body_from_aligned(aligned, alpha0, 1.0)[0][0]
        for alpha0 in (THIN.angles(113).alpha0, THIN.alpha0)
    )
    assert abs(M1 * 2 * cos / 3e-9 - 1) < 8e-16
    assert abs(off / M1 - 1) > 1e-9
    found = co.canonical_from_aligned(aligned, THIN.angles(113).alpha0, 0.0)
    J2 = math.hypot(M1, 5e-10, 0.5)
    assert found.J2mJ1 == pytest.approx((M1**2 + 2.5e-19) / (2 * (J2 + 0.5)), rel=1e-15, abs=0)
