"""The normal form: its two determinations of Lambda, what is left out, points put into it."""

from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map import conjugacy
from rigidpend.orbits.return_map import normal_form as module
from rigidpend.orbits.return_map.conjugacy import TorusForm
from rigidpend.orbits.return_map.expansions import Interval, in_blocks
from rigidpend.orbits.return_map.normal_form import normal_form, powers
from rigidpend.orbits.return_map.reduced import coefficients, reduced
from tests.orbits.integrate.problems import FIG4, GENERIC

DOUBLES, AT = precision(53), Interval(1.3342, 0.0, 1)


def coefficients_of(body: Body, bits: int = 53) -> Any:
    return coefficients(body.angles(bits + 32), "1", precision(bits))


def test_a_wrong_equation_shows_in_the_two_determinations_of_lambda(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """They differ by roundings too, most by those of derivatives in psi at n phases.

    A derivative is a sum of n terms of a size of n in all, whose weights are such sums too, of 3 n
    in all at a phase. That makes n (n + 3 n) roundings at most, of numbers of 3 Lambda_0.
    """
    c, n = coefficients_of(FIG4), 15
    wrong = c._replace(aligned=c.aligned._replace(force_p=c.aligned.force_p * 1.001))
    right, spoilt = (normal_form(x, AT, 9, n, 0.2, DOUBLES).disagreement for x in (c, wrong))
    assert right < 3 * n * (n + 3 * n) * 2.0**-53
    assert spoilt > 1e-11

    def cubic(Q: Any, *given: Any) -> Any:
        found = reduced(Q, *given)
        return found._replace(Qp=found.Qp + Q[0] * Q[0] * Q[1])

    # A wrong term of the third order shows as far from the orbit as it counts.
    monkeypatch.setattr(module, "reduced", cubic)
    near, far = (normal_form(c, AT, 3, 15, radius, DOUBLES).disagreement for radius in (0.1, 0.2))
    assert far == pytest.approx(4 * near, rel=1e-9)
    assert far > 1e-3


@pytest.mark.parametrize("least", [1e-4, 1e-7])
def test_the_normal_form_ends_with_the_first_terms_that_are_small_enough(least: float) -> None:
    radius = 0.3
    given: Any = (coefficients_of(FIG4), AT, 21, 21, radius, DOUBLES)
    whole, short = normal_form(*given), normal_form(*given, least_share=least)
    degrees = powers(21, 1).sum(axis=1)
    np.testing.assert_array_equal(short.odd, whole.odd[..., degrees <= short.degree])
    # Coefficients of waves are no larger than what they add up to at phases, nor far below.
    sizes = [np.abs(whole.odd[:, :2, degrees == D]).max() * radius**D for D in range(1, 22, 2)]
    last, before = (sizes[(short.degree - k) // 2] / sizes[0] for k in (1, 3))
    assert last < least < 8 * before


@pytest.mark.parametrize(
    ("bits", "degree", "n_phase", "points"),
    [(53, 21, 21, 1200), (53, 7, 21, 200), (53, 1, 21, 3), (113, 5, 11, 2)],
)
def test_order_points_are_put_into_the_normal_form_to_rounding(
    bits: int, degree: int, n_phase: int, points: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Slopes of half the degree serve one correction: of few degrees they leave too much."""
    blocks = Mock(wraps=in_blocks)
    monkeypatch.setattr(conjugacy, "in_blocks", blocks)
    a, random = precision(bits), np.random.default_rng(4)
    h = a.number(1.3342)
    given: Any = (coefficients_of(GENERIC, bits), Interval(h, 0 * h, 1), degree, n_phase, 0.1, a)
    form = TorusForm(normal_form(*given), a.array([1.3342]), a)
    psi = a.array(random.uniform(0, 6.28, points))
    beside = np.stack([a.array(x) for x in random.uniform(-0.4, 0.4, (2, points))])
    at = form.inverted(psi, *beside)
    off = np.abs(np.stack(form.placed(psi, at.u, at.v)[:2]) - beside)
    assert a.largest(off / np.abs(beside).max(axis=0)) < 2e-15 * 2.0 ** (53 - bits)
    # Blocks have room for the terms of each of their points, all up to the degree in u and in v.
    blocks.assert_called_once_with((points,), (degree + 1) ** 2, None)


@pytest.mark.parametrize(
    ("bits", "degree", "energies", "mu"),
    [(70, 21, 1, FIG4.mu), (96, 29, 1, FIG4.mu), (96, 29, 9, "0.02")],
)
def test_terms_in_doubles_at_fewer_nodes_leave_less_than_an_eighth_of_a_rounding(
    bits: int, degree: int, energies: int, mu: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each leaves a part, `GUARD_SHARE`; a rounding is of the largest at |u|, |v| = radius.

    With weight enough harmonics matter, and over an interval wide enough so do orders in energy.
    """
    a, radius, n = precision(bits), 1 / 16, 29
    at = Interval(a.number(1.3342), a.number(0.004 * (energies > 1)), energies)
    c = coefficients_of(Body(FIG4.A, FIG4.r, mu), bits)
    given: Any = (c, at, degree, n, radius, a)
    found = normal_form(*given)
    monkeypatch.setattr(module, "GUARD_SHARE", 1e-300)
    whole = normal_form(*given)
    for x, true, parity in ((found.odd, whole.odd, 1), (found.even, whole.even, 0)):
        of = radius ** powers(degree - 1 + parity, parity).sum(axis=1, dtype=float)
        off, all_ = (np.abs(a.floats(y)).reshape(len(y), -1, len(of)) for y in (x - true, true))
        share = (off * of).max() / (all_ * of).max(axis=(0, 2)).min()
        assert 0 < share < 2.0**-bits / 8
        # The terms of the highest degree have fewer orders in energy and phase.
        last = a.floats(x)[..., -1].reshape(energies, n, -1).any(axis=2)
        orders, harmonics = last.any(axis=1).sum(), last.any(axis=0).sum()
        assert orders < 5 if energies > 1 else orders == 1
        assert harmonics < 12


@pytest.mark.parametrize(("bits", "smaller"), [(96, 1.0), (80, 1e-4), (80, 1e-8)])
def test_points_by_terms_in_doubles_are_those_by_all_digits(
    bits: int, smaller: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Up to an eighth of a rounding of the largest u, v and time, where u is far smaller too."""
    a, random = precision(bits), np.random.default_rng(4)
    h = a.number(1.3342)
    nf = normal_form(coefficients_of(GENERIC, bits), Interval(h, 0 * h, 1), 21, 21, 0.1, a)
    psi = a.array(random.uniform(0, 6.28, 40))
    u, v = (a.array(x) for x in random.uniform(-0.1, 0.1, (2, 40)))
    beside = TorusForm(nf, a.array([1.3342]), a).placed(psi, smaller * u, v)[:2]
    found = TorusForm(nf, a.array([1.3342]), a).inverted(psi, *beside)
    monkeypatch.setattr(conjugacy, "GUARD_SHARE", 1e-300)
    true = TorusForm(nf, a.array([1.3342]), a).inverted(psi, *beside)
    for one, other in zip(found[:3], true[:3], strict=True):
        assert 0 < a.largest(one - other) / a.largest(other) < 2.0**-bits / 8
