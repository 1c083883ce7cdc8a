"""Passages: from one crossing of M3 = 0 to the next, past a periodic orbit, by the tables.

A passage of the upper periodic orbit does not change I and s, so that it is a chart, a logarithm
and an inverse chart. The sign of U tells on which side the orbit leaves. The lower orbit needs no
tables of its own: the reversor (M1, M2, -M3, gamma1, gamma2, -gamma3, -t) takes it to the upper
one, and (d, chi) to (d, -chi).
"""

from typing import Any, NamedTuple

import numpy as np

from rigidpend.numbers import Scalar
from rigidpend.orbits.precision import Precision
from rigidpend.orbits.return_map.charts import Charts, Invariants, invariants
from rigidpend.orbits.return_map.conjugacy import NormalPoint, TorusForm
from rigidpend.orbits.return_map.normal_form import NormalForm
from rigidpend.orbits.return_map.tables import ChartTable, Looked


class SectionPoint(NamedTuple):
    """Points of the section M3 = 0, described as if on separatrix 2 (rising) or 3."""

    rising: bool
    d: Any
    """(N,) dimensionless: Qm if rising, else Qp."""
    chi: Any
    """(N,) radians."""


class Passage(NamedTuple):
    """Passages, each from a crossing to another one: the changes between the two, (N,) each."""

    point: SectionPoint
    """The other crossing, with chi in [0, 2 pi)."""
    symbol: Any
    """Symbol of the route: 0 left, 1 right."""
    mirrored: Any
    """True if the orbit crosses beside separatrix 4 or 1, where `point` is its mirror image.

    For an orbit that comes from separatrix 4 or 1 itself it is the other way round."""
    turned: Any
    """Growth of chi, radians, whole turns included."""
    time: Any
    """Time t' from the crossing to the other; negative if backward."""
    theta3: Any
    """Growth of theta3, radians, of an orbit that comes from separatrix 2 or 3.

    From separatrix 4 or 1 it is minus that. None if the map does not have theta3."""
    inside: Any
    """True if the tables reach as far as the orbit; elsewhere all other values are meaningless."""
    slopes: Any
    """Derivatives (4, 2, N) of d, chi, time and theta3 in d and chi; None if not asked for.

    They are (3, 2, N) without theta3."""


class Entered(NamedTuple):
    """First crossings of orbits from beside the lower periodic orbit."""

    point: SectionPoint
    time: Any
    """(N,) time t' from the start."""
    theta3: Any
    """(N,) growth of theta3 from the start, radians; None if the map does not have theta3."""
    inside: Any
    """(N,) True if the tables reach as far as the orbit."""


class EnergyLevel(TorusForm):
    """The return map at one energy, or at one of its own for each orbit.

    Parameters
    ----------
    nf : NormalForm
    charts : 2 Chart
        Charts of downward and upward crossings.
    h : number or (N,) array
        Energies within the map's interval.
    a : Precision
    """

    def __init__(self, nf: NormalForm, charts: Charts, h: Scalar, a: Precision) -> None:
        super().__init__(nf, np.atleast_1d(a.array(h)), a)
        self.charts = [chart.at(self) for chart in charts]

    def enter(self, Qp: Scalar, phase: Scalar) -> Entered:
        """The first crossings of orbits that start at Qp > 0, Qm = 0, M3 < 0, beside separatrix 2.

        Qp is a dimensionless number, `phase` psi of the mirrored states, pi/2 - beta0/2 - theta2
        radians, (N,).
        """
        # The mirror images lie beside the upper orbit, to which they came from an upward crossing:
        # its inverse chart leads back to it.
        a, nf = self.a, self.nf
        at, inside = self.started(Qp, phase)
        zero, inverse = 0 * phase, self.charts[True].inverse
        I = at.u * at.v
        rates = self.rates(I)
        # v > 0 on the side of separatrix 2; on the other side the crossing is beside another one.
        inside &= (np.abs(I) <= inverse.width) & (at.v > 0)
        # chi + ln|V|/Lambda with V = v exp(Lambda (psi - chi)); for orbits outside ln(1) serves.
        s = phase + a.log(np.where(at.v > 0, at.v, 1 + zero)) / rates.exponent
        seen = inverse.look_up(np.where(inside, I, zero), s, a)
        chi = s + seen[1]
        # Time and chi run backward in the mirror image.
        time = at.tau + seen[2] - rates.rotation * (chi - phase)
        point = SectionPoint(True, seen[0], reduced_angle(-chi, a))
        return Entered(point, time, at.sigma + seen[3] if nf.theta3 else None, inside)

    def started(self, Qp: Scalar, phase: Scalar) -> tuple[NormalPoint, Any]:
        """u and v of starts at Qp with Qm = 0, and which lie within the normal form's radius, (N,).

        Starts beyond it are replaced by points on its border, because the series need have no
        inverse there.
        """
        zero = 0 * phase
        border, *_ = self.placed(phase, zero, zero + self.nf.radius)
        at = self.inverted(phase, np.where(border < Qp, border, zero + Qp), zero)
        return at, border >= Qp

    def passage(
        self, point: SectionPoint, *, backward: bool = False, slopes: bool = False
    ) -> Passage:
        """The passage that follows a crossing, or `backward` in time the one before it.

        Numbers and lists in `point` serve as arrays.
        With `slopes` it has its derivatives too.
        """
        # A list times zero would be empty, and a number has no axis of orbits.
        d, chi = (x if getattr(x, "ndim", 0) else np.atleast_1d(self.a.array(x)) for x in point[1:])
        point = SectionPoint(point.rising, d, chi)
        # The upper orbit is passed after an upward crossing and before a downward one.
        if point.rising != backward:
            return self._past_upper(point, slopes)
        # The lower orbit, by the reversor: it negates chi and time, and exchanges left and right.
        image = self._past_upper(point._replace(chi=-point.chi), slopes)
        there = image.point._replace(chi=reduced_angle(-image.point.chi, self.a))
        changed = image.slopes
        if changed is not None:
            # Of d, chi, time and theta3, in d and in chi: all but d are negated, and so is chi
            # before the passage.
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
        """The passage of the upper orbit: forward from upward crossings, backward from others."""
        a, rising = self.a, point.rising
        forward, inverse = self.charts[rising].forward, self.charts[not rising].inverse
        # Orbits outside are looked up at 0 instead, where all functions are harmless numbers.
        inside = np.abs(point.d) <= forward.width
        d = np.where(inside, point.d, 0 * point.d)
        seen = _seen(forward, d, point.chi, slopes, a)
        with np.errstate(divide="ignore", invalid="ignore"):
            at = invariants(not rising, seen, point.chi, self)
        # U, or V backward in time: its sign is the side, and 0 means that the orbit never leaves.
        other = seen.value[0 if rising else 1]
        inside = inside & (np.abs(at.I) <= inverse.width) & (other != 0)
        I, s = (np.where(inside, x, 0 * d) for x in (at.I, at.s))
        there = _seen(inverse, I, s, slopes, a)
        right = other > 0
        chi = s + there.value[1]
        # theta3 grows by the opposite amount beside the mirror image of a separatrix.
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
    """The functions of a table at points, with their derivatives if `slopes`."""
    return table.look_up_slopes(x, phase, a) if slopes else Looked(table.look_up(x, phase, a))


def _chained(seen: Looked, there: Looked, at: Invariants, turned: Scalar, side: Any) -> Any:
    """The derivatives (4, 2, N) of d, chi, time and theta3 in d and chi, by the chain rule.

    They are (3, 2, N) without theta3. The arguments are those of `_past_upper`.
    """
    columns = []
    for k, by in enumerate((seen.by_x, seen.by_phase)):
        # k = 0 for derivatives in d, 1 for those in chi. The inverse chart gives chi - s.
        I, s = (at.by_d, at.by_chi)[k]
        d, chi, time, *theta3 = there.by_x * I + there.by_phase * s
        chi = chi + s
        # The time is that of the chart, less that of the inverse chart, and rotation(I) turned with
        # turned = chi' - chi; k is the derivative of chi itself.
        rotation, growth = at.rates.rotation, at.rates.rotation_slope * I
        time = by[2] - time + growth * turned + rotation * (chi - k)
        gained = [by[3] - side * x for x in theta3]
        columns.append(np.stack((d, chi, time, *gained)))
    return np.stack(columns, axis=1)


def reduced_angle(angle: Any, a: Precision) -> Any:
    """The angle less whole turns, in [0, 2 pi) up to a rounding."""
    turn = 2 * a.pi
    return angle - turn * np.floor(a.floats(angle / turn))
