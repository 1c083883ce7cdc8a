"""Orders of the tables: how many terms a body, an energy and a precision need.

A first look at the charts, in doubles and of low order, measures how far the orbits' layer
reaches. The rates at which terms shrink follow from that; whether they are small enough is
measured on the finished tables.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rigidpend.orbits.return_map.charts import at_energies, forward_table, look_up_slopes
from rigidpend.orbits.return_map.expansions import Interval, phases
from rigidpend.orbits.return_map.normal_form import MapError, normal_form
from rigidpend.orbits.return_map.precision import precision
from rigidpend.orbits.return_map.reduced import Coefficients

REACH = 4.0
"""Largest |I| of the tables over that of the splitting.

Of 8,000 random orbits of 15 symbols with the body of Fig. 4, 99.85 % stay inside."""
MARGIN = 1.15
"""Margin of the width in d over the least that the first look finds."""
LARGEST_RADIUS = 0.5
"""Largest radius of u and v, in units of their size at the singularity.

Beyond it a series needs too many terms."""
LOOK = 3, 9, 7
"""Sizes of the first look: nodes in d and in chi, degree of the normal form."""


class Orders(NamedTuple):
    """Sizes of the tables and of the normal form."""

    degree: int
    n_phase_orbit: int
    """Phases of the normal form."""
    n_x: int
    """Chebyshev nodes in d and in I."""
    n_phase: int
    """Phases of a chart."""
    n_energy: int
    length: float
    """Length of the arcs, t'."""

    def larger(self, *, inner: bool, x: bool, phase: bool, energy: bool) -> Orders:
        """The orders for another attempt, where some were too small."""
        return Orders(
            _odd(self.degree * (1.3 if inner else 1)),
            _odd(self.n_phase_orbit * (1.3 if inner else 1)),
            math.ceil(self.n_x * (1.3 if x else 1)),
            _odd(self.n_phase * (1.3 if phase else 1)),
            math.ceil(self.n_energy * (1.3 if energy else 1)),
            self.length,
        )


class Layer(NamedTuple):
    """The layer of orbits that the tables are to hold."""

    invariant: float
    """Largest |I|."""
    widths: tuple[float, float]
    """Largest |d| on downward and upward crossings."""


def first_look(c: Coefficients, h: float, reach: float = REACH) -> Layer:
    """Estimate the layer's width: `reach` times the splitting, from charts of low order.

    Parameters
    ----------
    c : Coefficients
        Floats.
    h : float
    reach : float

    Raises
    ------
    MapError
        There is no splitting (mu = 0), or it is too wide.
    """
    k, a = c.aligned, precision(53)
    rate = math.sqrt(2 * h / k.kappa) * k.half_sigma
    guess = max(abs(k.force_p), abs(k.force_m)) * math.pi / 2 / rate
    if guess == 0:
        raise MapError("without weight (mu = 0) nothing is split and no map is needed")
    n_x, n_phase, degree = LOOK
    length = arc_length(c, h, guess)
    n = _harmonics(c, h, a.bits)
    nf = normal_form(c, Interval(h, 0.0, 1), degree, n, 0.0, a)
    splittings, slopes = [], []
    for rising in (False, True):
        table = forward_table(rising, guess, n_x, n_phase, nf, c, length, a)
        at = phases(36, a)
        values = at_energies(table, np.ones((1, 1)))
        seen = look_up_slopes(table, values, 0 * at, at, a)
        U, V = seen.value[:2]
        splittings.append(float(np.abs(U * V).max()))
        slopes.append(float(np.abs(U * seen.by_x[1] + V * seen.by_x[0]).min()))
    invariant = reach * max(splittings)
    low, high = (
        MARGIN * (invariant + split) / slope
        for split, slope in zip(splittings, slopes, strict=True)
    )
    return Layer(invariant, (low, high))


def radius(c: Coefficients, h: float, width: float) -> float:
    """|u| and |v| at the arcs' ends, in units of their size at the nearest singularity.

    Without weight Qp is Q/cosh(x) on separatrix 2, v = 2 Q exp(-x), u = d exp(x)/2 and
    Q = J2 sin(alpha0); the arcs end where |u| = |v|.
    """
    Q = math.sqrt(2 * h / c.aligned.kappa) * 2 * c.aligned.half_sigma
    return math.sqrt(width / (4 * Q))


def arc_length(c: Coefficients, h: float, width: float) -> float:
    """The length t' of arcs after which |u| = |v| for points at d = width.

    Raises
    ------
    MapError
        The layer is so wide that no such arc is short of the singularity.
    """
    r = radius(c, h, width)
    if r > LARGEST_RADIUS:
        raise MapError(
            f"mu is too large: the layer around the separatrices, |d| up to {width:.2g}, reaches "
            f"{r:.2g} of the normal form's radius, more than {LARGEST_RADIUS}"
        )
    return -math.log(r) / (math.sqrt(2 * h / c.aligned.kappa) * c.aligned.half_sigma)


def orders(c: Coefficients, energies: tuple[float, float], layer: Layer, bits: int) -> Orders:
    """The orders with which terms shrink to `bits` bits, by the rates of the leading ones."""
    centre, half_width = (energies[0] + energies[1]) / 2, (energies[1] - energies[0]) / 2
    width, nats = max(layer.widths), bits * math.log(2)
    r, n = radius(c, centre, width), _harmonics(c, centre, bits)
    return Orders(
        _odd((nats + 4) / -math.log(r)),
        n,
        math.ceil(nats / -math.log(min(0.5, 2 * r * r)) + 1),
        n,
        math.ceil(nats / math.log(2 * centre / half_width) + 1) if half_width else 1,
        arc_length(c, centre, width),
    )


def _harmonics(c: Coefficients, h: float, bits: int) -> int:
    """The number of Fourier terms: the harmonics of order k are of order (mu/h)^k."""
    mu = math.hypot(c.aligned.mu_r1, c.aligned.mu_r2)
    return _odd(2 * bits * math.log(2) / -math.log(min(0.5, 2 * mu / h)) + 1)


def _odd(x: float) -> int:
    """The next odd number."""
    return 2 * math.ceil((x - 1) / 2) + 1
