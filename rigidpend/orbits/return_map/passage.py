"""Passages: from one crossing of M3 = 0 to the next, past a periodic orbit, by the tables.

Past the upper periodic orbit I and s are kept, so that a passage is a chart, a logarithm and
an inverse chart. The sign of U tells on which side the orbit leaves. The lower orbit needs no
tables: the reversor (M1, M2, -M3, gamma1, gamma2, -gamma3, -t) takes it to the upper one, and
(d, chi) to (d, -chi).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.return_map.charts import Charts, ChartTable, Invariants, Looked, invariants
from rigidpend.orbits.return_map.conjugacy import Beside, TorusForm
from rigidpend.orbits.return_map.normal_form import NormalForm
from rigidpend.orbits.return_map.precision import Precision


class SectionPoint(NamedTuple):
    """Points of the section M3 = 0, described as if on separatrix 2 (rising) or 3."""

    rising: bool
    d: Any
    """(N,) dimensionless: Qm where rising, else Qp."""
    chi: Any
    """(N,) radians."""


class Passage(NamedTuple):
    """Passages: the changes between two crossings, (N,) each."""

    point: SectionPoint
    """The other crossing, chi in [0, 2 pi)."""
    symbol: Any
    """0 left, 1 right."""
    mirrored: Any
    """True if the new point is the mirror image of what it would be on separatrix 2 or 3."""
    turned: Any
    """Growth of chi, radians, whole turns included."""
    time: Any
    """t' from the crossing to the other; negative if backward."""
    theta3: Any
    """Growth of theta3, radians, for an orbit that was on separatrix 2 or 3; else minus that.

    None where the map does not tell it."""
    inside: Any
    """True if the tables reach so far; elsewhere all else is of no use."""
    slopes: Any
    """(4, 2, N) the derivatives of d, chi, time and theta3 in d and chi; None if not asked for.

    (3, 2, N) without that of theta3."""


class Entered(NamedTuple):
    """First crossings of orbits from beside the lower periodic orbit."""

    point: SectionPoint
    time: Any
    """(N,) t' from the start."""
    theta3: Any
    """(N,) radians, growth from the start; None where the map does not tell it."""
    inside: Any
    """(N,), whether the tables reach so far."""


class EnergyLevel(TorusForm):
    """The return map at one energy, or at one of its own for each orbit.

    Parameters
    ----------
    nf : NormalForm
    charts : 2 Chart
        Of downward and upward crossings.
    h : number or (N,) array
        Energies within the map's interval.
    a : Precision
    """

    def __init__(self, nf: NormalForm, charts: Charts, h: Scalar, a: Precision) -> None:
        super().__init__(nf, np.atleast_1d(a.array(h)), a)
        self.charts = [chart.at(self) for chart in charts]

    def enter(self, Qp: Scalar, phase: Scalar) -> Entered:
        """Orbits that start at Qp > 0, Qm = 0, M3 < 0, and first cross beside separatrix 2.

        Qp is a dimensionless number, `phase` psi of the mirrored states, pi/2 - beta0/2 - theta2
        radians, (N,).
        """
        a, nf = self.a, self.nf
        at, inside = self.started(Qp, phase)
        zero, inverse = 0 * phase, self.charts[True].inverse
        I = at.u * at.v
        rates = self.rates(I)
        inside &= (np.abs(I) <= inverse.width) & (at.v > 0)
        s = phase + a.log(np.where(at.v > 0, at.v, 1 + zero)) / rates.exponent
        seen = inverse.look_up(np.where(inside, I, zero), s, a)
        chi = s + seen[1]
        time = at.tau + seen[2] - rates.rotation * (chi - phase)
        point = SectionPoint(True, seen[0], reduced_angle(-chi, a))
        return Entered(point, time, at.sigma + seen[3] if nf.theta3 else None, inside)

    def started(self, Qp: Scalar, phase: Scalar) -> tuple[Beside, Any]:
        """Such starts in the normal form, and which of them lie within its radius, (N,).

        For the others the border stands, for beyond it the series need not have an inverse.
        """
        zero = 0 * phase
        border, *_ = self.placed(phase, zero, zero + self.nf.radius)
        at = self.inverted(phase, np.where(border < Qp, border, zero + Qp), zero)
        return at, (border >= Qp) & (at.v <= self.nf.radius)

    def passage(
        self, point: SectionPoint, *, backward: bool = False, slopes: bool = False
    ) -> Passage:
        """The passage that follows a crossing, or `backward` in time the one before it.

        Its `slopes` are left out unless they are asked for.
        """
        if point.rising != backward:
            return self._past_upper(point, slopes)
        image = self._past_upper(point._replace(chi=-point.chi), slopes)
        there = image.point._replace(chi=reduced_angle(-image.point.chi, self.a))
        changed = image.slopes
        if changed is not None:
            signs = np.array([[1, -1], [-1, 1], [-1, 1], [-1, 1]])[:, :, None]
            changed = changed * signs[: len(changed)]
        return image._replace(
            point=there,
            symbol=1 - image.symbol,
            turned=-image.turned,
            time=-image.time,
            theta3=-image.theta3 if self.nf.theta3 else None,
            slopes=changed,
        )

    def _past_upper(self, point: SectionPoint, slopes: bool) -> Passage:
        """Past the upper periodic orbit, forward from upward crossings, backward from others."""
        a, rising = self.a, point.rising
        forward, inverse = self.charts[rising].forward, self.charts[not rising].inverse
        inside = np.abs(point.d) <= forward.width
        d = np.where(inside, point.d, 0 * point.d)
        seen = _seen(forward, d, point.chi, slopes, a)
        with np.errstate(divide="ignore", invalid="ignore"):
            at = invariants(not rising, seen, point.chi, self)
        other = seen.value[0 if rising else 1]
        inside = inside & (np.abs(at.I) <= inverse.width) & (other != 0)
        I, s = (np.where(inside, x, 0 * d) for x in (at.I, at.s))
        there = _seen(inverse, I, s, slopes, a)
        right = other > 0
        chi = s + there.value[1]
        turned, side = chi - point.chi, np.where(right, 1, -1)
        return Passage(
            SectionPoint(not rising, there.value[0], reduced_angle(chi, a)),
            right.astype(np.uint8),
            ~right,
            turned,
            seen.value[2] - there.value[2] + at.rates.rotation * turned,
            seen.value[3] - side * there.value[3] if self.nf.theta3 else None,
            inside,
            _chained(seen, there, at, turned, side) if slopes else None,
        )


def _seen(table: ChartTable, x: Scalar, phase: Scalar, slopes: bool, a: Precision) -> Looked:
    return table.look_up_slopes(x, phase, a) if slopes else Looked(table.look_up(x, phase, a))


def _chained(seen: Looked, there: Looked, at: Invariants, turned: Scalar, side: Any) -> Any:
    """The derivatives (4, 2, N) of d, chi, time and theta3 in d and chi; (3, 2, N) without it."""
    columns = []
    for k, by in enumerate((seen.by_x, seen.by_phase)):
        I, s = (at.by_d, at.by_chi)[k]
        d, chi, time, *theta3 = there.by_x * I + there.by_phase * s
        chi = chi + s
        rotation, growth = at.rates.rotation, at.rates.rotation_slope * I
        time = by[2] - time + growth * turned + rotation * (chi - k)
        gained = [by[3] - side * x for x in theta3]
        columns.append(np.stack((d, chi, time, *gained)))
    return np.stack(columns, axis=1)


def reduced_angle(angle: Any, a: Precision) -> Any:
    """The angle in [0, 2 pi), to rounding."""
    turn = 2 * a.pi
    return angle - turn * np.floor(a.floats(angle / turn))
