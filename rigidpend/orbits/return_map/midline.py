"""Midlines: the curves on the section midway between the two asymptotic surfaces.

Weight displaces both surfaces together by sinh(nu)/nu times as much as it splits them. Where nu is
large, d as a table gives it would keep few digits of the distance at which an orbit passes. So the
tables of such bodies hold d less the midline: what is left is as small as the layer of orbits.

The reversor maps one surface to the other and (d, chi) to (d, -chi). So the midline is the even
part of either surface in chi, a series of cosines, and half of their splitting is the odd part.
The layer of orbits that tables cover lies around both midlines, or around d = 0 without them.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rigidpend.orbits.precision import Precision, precision, product
from rigidpend.orbits.return_map.expansions import (
    Interval,
    chebyshev_analysis,
    chebyshev_basis,
    fourier_analysis,
)


class Midline(NamedTuple):
    """The midline of a section, d as a function of chi and the energy."""

    values: Any
    """(count, K) doubles: coefficients of polynomials of the energy and of cos(k chi).

    They are exact: tables hold d less this very function, however close it is to the surfaces."""

    def in_unit(self, unit: float) -> Midline:
        """The same curve, but for roundings, in another unit of M."""
        return Midline(self.values * unit)

    def middle(self) -> Midline:
        """The midline at the middle of the interval of energies alone."""
        at = chebyshev_basis(np.zeros(1), len(self.values), precision(53))
        return Midline(at @ self.values)

    def at(self, cos: Any, h: Any, sizes: Any, energies: Interval, a: Precision) -> Any:
        """d at N points of the section from cos(chi), in groups of some sizes by the energy h."""
        count, terms = self.values.shape
        centre, half_width = (a.array(x)[()] for x in energies[:2])
        at = Interval(centre, half_width, count).basis(h, a)
        by_energy = product(at, a.array(self.values))
        return (np.repeat(by_energy, sizes, axis=0) * chebyshev_basis(cos, terms, a)).sum(axis=1)


Midlines: TypeAlias = tuple[Midline, Midline]
"""The midlines of downward and of upward crossings."""
NONE: Midlines = (Midline(np.zeros((1, 1))), Midline(np.zeros((1, 1))))
"""The lines d = 0."""


class Layer(NamedTuple):
    """The layer of orbits that the tables are to cover."""

    widest_I: float
    """Largest |I|."""
    widths: tuple[float, float]
    """Largest |d|, counted from the midlines, on downward and upward crossings."""
    midlines: Midlines = NONE

    def in_unit(self, unit: float) -> Layer:
        """The same layer in another unit of M."""
        # I = u v is of second order in M, d of first.
        down, up = (x * unit for x in self.widths)
        lines = self.midlines[0].in_unit(unit), self.midlines[1].in_unit(unit)
        return Layer(self.widest_I * unit**2, (down, up), lines)


def midline(surface: Any, least: float) -> Midline:
    """The midline from a surface's d at Chebyshev nodes of the energy and phases: (E, phases).

    Terms below `least` are left out.
    """
    a, (count, n) = precision(53), surface.shape
    harmonics = surface @ fourier_analysis(n, a).T
    # The cosines of the harmonics 0, 1, 2, ...; the sines between them are the splitting.
    even = np.concatenate((harmonics[:, :1], harmonics[:, 1::2]), axis=1)
    values = chebyshev_analysis(count, a) @ even
    kept = np.abs(values) >= least
    count, terms = (1 + np.flatnonzero(kept.any(axis=k)).max(initial=0) for k in (1, 0))
    return Midline(np.where(kept, values, 0.0)[:count, :terms])
