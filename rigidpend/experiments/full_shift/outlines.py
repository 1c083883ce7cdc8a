"""Outlines of the sets of a full shift and of their images, as they are drawn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rigidpend.experiments.full_shift.proof import Proven
from rigidpend.numbers import Array
from rigidpend.routes.certified import sections
from rigidpend.routes.certified.models import Family
from rigidpend.routes.certified.pieces import Quad

SIDE = 24
"""Points on each side of an outline."""


def drawn(sets: Sequence[Quad], proven: Proven) -> dict[str, Array]:
    """Outlines of the sets and of their images, and the line's image, by the polynomials."""
    side, one = np.linspace(-1, 1, SIDE), np.ones(SIDE)
    around = np.concatenate((side, one, -side, -one)), np.concatenate((-one, side, one, -side))
    images = [(found.d, found.g) for found in proven.arrivals]
    own = [_in_chart(sets, quad.rising, sections.place(quad), *around) for quad in sets]
    over = [_in_chart(sets, not q.rising, x, *around) for q, x in zip(sets, images, strict=True)]
    start, rising = proven.start, sets[proven.crossed[0].target].rising
    line = _in_chart(sets, rising, (start.d, start.g), side, 0 * side)
    return {
        f"{prefix}{name}": np.array(outlines)
        for prefix, each in (("", zip(*own, strict=True)), ("image_", zip(*over, strict=True)))
        for name, outlines in zip(("chi", "d"), each, strict=True)
    } | {"line_chi": line[0], "line_d": line[1]}


def _in_chart(
    sets: Sequence[Quad], rising: bool, where: tuple[Family, Family], u: Array, v: Array
) -> tuple[Array, Array]:
    """The coordinates chi and d of points of a section, d less that of the stable surface."""
    d, g = (_values(each, u, v) for each in where)
    # The sets of a section lie on either side of its stable surface, equally far: the mean of
    # their curves is near it.
    curves = [np.array(quad.p, dtype=float) for quad in sets if quad.rising == rising]
    return -np.arcsin(g), d - np.polynomial.polynomial.polyval(g, np.mean(curves, axis=0))


def _values(family: Family, u: Array, v: Array) -> Array:
    """Values at some u and v of a family that does not depend on x, at the energy w = 0."""
    terms = family.doubled.to_dict().items()
    unit = 2.0 ** -(family.bits + 1)
    middle = ((c, at) for at, c in terms if not at[3])
    return np.asarray(sum(int(c) * unit * u ** int(k) * v ** int(l) for c, (_, k, l, _) in middle))
