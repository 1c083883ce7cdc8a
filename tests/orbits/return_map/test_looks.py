"""Looks at the layer of orbits: what they refuse, from both sides."""

import math
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map import MapError, looks, normal_form
from rigidpend.orbits.return_map.looks import (
    LARGEST_RADIUS,
    Rough,
    first_look,
    least_degree,
    second_look,
    whole_reach,
)
from rigidpend.orbits.return_map.midline import Layer
from rigidpend.orbits.return_map.reduced import coefficients
from tests.bodies import FIG4

H = 1.3342
WHOLE: Any = 0.0, 0, None
"""Arguments of looks at a layer over the whole displacement, at one energy."""


@pytest.fixture(scope="module")
def rough() -> Rough:
    return Rough(coefficients(FIG4.angles(), "1", precision(53)), H)


def test_a_layer_below_what_pairs_of_doubles_resolve_is_refused(
    rough: Rough, monkeypatch: pytest.MonkeyPatch
) -> None:
    for share, refused in ((0, "less than 1e-300 of"), (0.999, "some 9e-13 of")):
        monkeypatch.setattr(looks, "layer_width", lambda _, share=share: share * 2.0**-40)
        with pytest.raises(MapError, match=f"nearly symmetric.*{refused}"):
            whole_reach(rough)
    monkeypatch.setattr(looks, "layer_width", lambda _: 1.001 * 2.0**-40)
    assert whole_reach(rough) > 0


def test_only_a_body_without_any_force_is_without_weight(rough: Rough) -> None:
    """In the Hess case one of both is zero."""
    c, none = rough.c.aligned, {"force_p": 0.0, "force_m": 0.0}
    for name in none:
        assert whole_reach(Rough(rough.c._replace(aligned=c._replace(**{name: 0.0})), H)) > 0
    with pytest.raises(MapError, match=r"without weight.*give mu > 0"):
        whole_reach(Rough(rough.c._replace(aligned=c._replace(**none)), H))


@pytest.mark.parametrize(
    ("whole", "reached", "tried"),
    [
        (5.5, 5.6, [5.5]),
        (5.5, 4.41, [5.5, 4.4]),
        (5.5, 4.39, [5.5, 4.4, 3.52]),
        (5.5, 2.26, [5.5, 4.4, 3.52, 2.816, 2.2528]),
        (5.5, 2.2, None),
        # The next would reach 2.16.
        (2.7, 2.65, None),
        (1.3, 1.4, [1.3]),
        (1.3, 1.2, None),
    ],
)
def test_tables_reach_as_far_as_series_shrink_and_the_reason_is_that_of_the_whole_layer(
    rough: Rough, monkeypatch: pytest.MonkeyPatch, whole: float, reached: float, tried: Any
) -> None:
    one, asked = first_look(rough, 1.0).widest_I, []

    def second_look(_: Rough, layer: Layer, *_of: Any) -> Any:
        asked.append(layer.widest_I / one)
        if asked[-1] > reached:
            raise MapError(f"not as far as {asked[-1]:.3g}")
        return "seen"

    monkeypatch.setattr(looks, "whole_reach", lambda _: whole)
    monkeypatch.setattr(looks, "second_look", second_look)
    if tried is None:
        with pytest.raises(MapError, match=f"not as far as {whole}"):
            looks.looks(rough, *WHOLE)
        assert asked[-1] >= 2.2 or len(asked) == 1
    else:
        assert looks.looks(rough, *WHOLE)[0].widest_I / one == pytest.approx(tried[-1])
        assert asked == pytest.approx(tried)


@pytest.mark.parametrize(("mu", "degree"), [("0.0095", 59), ("0.0096", 61)])
def test_series_in_the_nome_reach_over_the_layer_of_a_thin_body_which_others_do_not(
    mu: str, degree: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As far as they take the degree 60 at most."""
    body = Body(("2.274", "0.365", "2.206"), ("0.983", "0.18", 0), mu)
    thin = Rough(coefficients(body.angles(), "1", precision(53)), 1.3)
    layer = first_look(thin, looks.whole_reach(thin))
    refused = f"that it takes the degree {degree}"
    if degree < 60:
        assert (
            least_degree(second_look(thin, layer, thin.c, precision(53)).by_degree, 2.0**-53)
            == degree
        )
        monkeypatch.setattr(normal_form, "normalization", lambda c, h, count: np.eye(1, count)[0])
        refused = "the series of the map do not shrink"
    with pytest.raises(MapError, match=f"{refused}$"):
        second_look(thin, layer, thin.c, precision(53))


def test_arcs_end_short_of_the_singularity(rough: Rough) -> None:
    """The radius grows as the root of the width."""
    widest = 0.25 / rough.radius(1.0) ** 2
    assert LARGEST_RADIUS == 0.5
    assert rough.arc_length(0.999 * widest) > 0
    with pytest.raises(MapError, match="mu is too large"):
        rough.arc_length(1.001 * widest)


def test_arcs_end_where_both_components_are_equal(rough: Rough) -> None:
    """Without weight v = 2 Q exp(-x) falls, and u = d exp(x)/2 rises, at x = u t'."""
    c, d = rough.c.aligned, 1e-3
    J2 = math.sqrt(2 * H / c.kappa)
    x, Q = rough.arc_length(d) * J2 * c.half_sigma, J2 * 2 * c.half_sigma
    assert d * math.exp(x) / 2 == pytest.approx(2 * Q * math.exp(-x))
    assert rough.border(d) == pytest.approx(d * math.exp(x) / 2)


@pytest.mark.parametrize("every", [(0, 1), (0,), (1,)])
def test_terms_that_vanish_by_symmetry_do_not_count(every: tuple[int, ...]) -> None:
    """Terms fall by ten from one to the next, and all, the even or the odd ones are there."""
    k = np.arange(15)
    sizes = np.where(np.isin(k % 2, every), 10.0**-k, 0.0)
    for digits in (20, 30):
        assert digits - 1 <= looks.terms_until(sizes, 10.0**-digits) <= digits


def test_series_that_hardly_shrink_are_refused() -> None:
    orders = np.arange(40)
    assert looks.terms_until(np.exp(-0.0501 * orders), 1e-3) == pytest.approx(7 / 0.0501, abs=3)
    with pytest.raises(MapError, match="do not shrink"):
        looks.terms_until(np.exp(-0.0499 * orders), 1e-3)
