"""Return maps built for a body and an interval of energies, checked, or refused with a reason."""

import functools
import itertools
import math
from dataclasses import dataclass
from decimal import Decimal
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rigidpend.mechanics import floquet
from rigidpend.mechanics.body import Body
from rigidpend.numbers import Numbers, Scalar, checked
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import GUARD_BITS, Exact, exact
from rigidpend.orbits import M_UNITS
from rigidpend.orbits.integrate.arithmetic import PAIRS
from rigidpend.orbits.precision import (
    MOST_IN_PAIRS,
    MOST_IN_TRIPLES,
    Precision,
    in_sums,
    precision,
    rounded,
)
from rigidpend.orbits.return_map.charts import Arcs, Charts, section_charts
from rigidpend.orbits.return_map.checks import Errors, measured
from rigidpend.orbits.return_map.expansions import Interval
from rigidpend.orbits.return_map.looks import Rough, Shrinking, looks
from rigidpend.orbits.return_map.midline import Layer, Midlines
from rigidpend.orbits.return_map.normal_form import MapError, NormalForm, normal_form
from rigidpend.orbits.return_map.orders import Orders, building_seconds, orders
from rigidpend.orbits.return_map.passage import EnergyLevel
from rigidpend.orbits.return_map.poincare import section_point
from rigidpend.orbits.return_map.program import Program, entry, program
from rigidpend.orbits.return_map.reduced import Coefficients, coefficients

ALLOWED_ROUNDINGS = 2.0**13
"""Allowed error of a map in doubles, or with tables of no more bits than its own, in roundings.

With the body of Fig. 4 finished maps err by some tens of roundings, and by 700 at mu = 0.01."""
SPARE_BITS = 6
"""Bits by which tables are sharper than the map's precision, where these are pairs of doubles."""
MARGIN_BITS = 2
"""Bits by which the first coefficients left out are planned to be below what tables resolve.

At the ends of a table's width all coefficients left out add up."""
NARROW_BITS = 5
"""Further such bits beside a midline.

With none two of seven maps took a second attempt; with five none of nineteen did."""
INNER = 32.0
"""Factor by which the first terms of the normal form left out are below a rounding of the map.

With 11 bodies drawn by lot charts stated 5e-4 to 1.6 of it, where these terms came to just that.
Where passages take 36 to 53 rotations, smaller terms leave up to a seventh fewer orbits open."""
LEAST_ROUNDINGS = 32
"""Error of a finished map in roundings, at least: those of Fig. 4's body err by some tens."""
LAST_BITS = 8
"""Factor by which tables of the most bits lose fewer terms: no sharper map follows them.

So those of five deep bodies left 0.50 to 0.63 of the orbits open that they do without it, for 3 to
17 % more time."""
ATTEMPTS = 4
"""Number of attempts, each with higher orders than the last, before a map is refused."""
FLOQUET = 1e-11
"""Largest difference of Lambda_0 from the Floquet exponent, which is found in doubles.

Both are growths per radian of psi."""


class Design(NamedTuple):
    """Design of a map: maps of different designs share no rounding and no truncation."""

    unit: str = M_UNITS[0]
    """Unit, as a decimal: M is multiplied by it, mu and h by its square, t' is divided by it."""
    arc_stretch: float = 1.0
    """Factor on the duration of the arcs, which for 1 end where |u| = |v|."""
    more_terms: int = 0
    """Number of further terms of every expansion, even."""
    phase_shift: float = 0.0
    """Shift of phases before they are rounded, radians."""
    narrower: int = 0
    """Bits by which the layer of orbits is narrower than the surfaces' displacement.

    With any, tables count d from the midlines, and so do points of the section."""
    theta3: bool = True
    """True if the map gives the growth of theta3, which takes a fifth of the time to build."""


class Costly(MapError):
    """Refusal of a map that would take longer to build than its budget, in seconds of a core.

    `needed` is the least time that building it takes.
    """

    def __init__(self, needed: float, budget: float) -> None:
        # Both numbers are arguments, from which an exception out of another process is made anew.
        super().__init__(needed, budget)
        self.needed = needed

    def __str__(self) -> str:
        needed, budget = self.args
        return (
            f"its tables would take {needed:.2g} s of a core at least, more than the {budget:.2g} s"
            " that they may: integration is expected to be faster"
        )


WITH_THETA3 = Design()
"""Design of a map that gives theta3 too."""
FIRST, SECOND, THIRD = (
    WITH_THETA3._replace(theta3=False),
    Design(M_UNITS[1], 1.06, 2, 0.7, theta3=False),
    Design(M_UNITS[2], 1.03, 2, 1.9, theta3=False),
)
"""Designs of up to three maps for route codes, which need no theta3."""


@dataclass(frozen=True, repr=False)
class ReturnMap:
    """The return map of the section M3 = 0 over an interval of energies.

    Attributes
    ----------
    body : Body
    bits : int
        Precision of the map.
    energies : 2 Exact
        Least and largest energy, physical units, as mu.
    errors : Errors
        Measured errors, relative to the largest values of each table, of the tables before their
        numbers are rounded to `bits`.
    orders : Orders
    design : Design
    normal_form : NormalForm
    charts : 2 Chart
        Charts of downward and of upward crossings.
    midlines : 2 Midline
        Midlines of the sections of downward and of upward crossings, from which d counts.
    cost : float
        Expected seconds of a core for building it.
    """

    body: Body
    bits: int
    energies: tuple[Exact, Exact]
    errors: Errors
    orders: Orders
    design: Design
    normal_form: NormalForm
    charts: Charts
    midlines: Midlines
    cost: float

    def __repr__(self) -> str:
        # The tables hold thousands of numbers.
        low, high = map(float, self.energies)
        return (
            f"<ReturnMap of {self.body},\n h = {low} to {high}, {self.bits} bits,"
            f" errors of its tables up to {self.errors.largest:.2g}>"
        )

    def at(self, h: Scalar) -> EnergyLevel:
        """The map at one energy h, or at one for each of N orbits.

        Raises ParameterError where h is outside of the map's interval.
        """
        a, (low, high) = precision(self.bits), map(float, self.energies)
        if isinstance(h, str | Decimal | Exact):
            h = a.number(checked.number("h", h))
        given = a.array(h)
        shown = np.atleast_1d(a.floats(given))
        # An energy that is beyond an end of the interval by a rounding counts as that end.
        off = ~(np.abs(shown - (low + high) / 2) <= (high - low) / 2 + 2.0**-50 * abs(high))
        if off.any():
            message = f"the map is one of energies from {low} to {high}, got h = {shown[off][0]}"
            raise ParameterError("h", message)
        unit = a.number(exact(self.design.unit))
        return EnergyLevel(self.normal_form, self.charts, given * unit**2, a)

    @property
    def left_out(self) -> float:
        """The size that all terms left out of the tables may have together, relative.

        It is a twelfth of the stated error, which is sixteen times the largest difference at
        held-out points; and at least a fourth of a rounding of the tables. Of tables that have all
        the bits of pairs of doubles it is an eighth of this (`LAST_BITS`).
        """
        size = max(2.0 ** -(table_bits(self.bits) + 2), self.errors.largest / 12)
        return size / LAST_BITS if table_bits(self.bits) == MOST_IN_PAIRS else size

    def program(self, bits: int, least_Qp: Scalar, most_Qp: Scalar, coarse: float = 0.0) -> Program:
        """The program of this map for `kernel.follow`: starts at least_Qp <= Qp <= most_Qp.

        Its numbers are doubles (53 bits) or pairs of doubles. With `coarse`, terms that together
        come to this size, relative, are left out, so that the program errs by as much. Raises
        MapError if the normal form does not reach as far as `most_Qp`.
        """
        starts, a = (least_Qp, most_Qp), precision(self.bits)
        key = bits, *starts, coarse
        if key not in self._kept:
            # Programs of different precisions with the same starts share their table.
            if starts not in self._kept:
                self._kept[starts] = entry(self.normal_form, *starts, a)
            # In doubles, terms that together come to a fourth of a rounding are without effect.
            threshold = max(self.left_out, coarse, 2.0**-55 if bits == 53 else 0.0)
            given = self.normal_form, self.charts, self._kept[starts], threshold, a
            self._kept[key] = program(*given, 53 if bits == 53 else PAIRS)
        return self._kept[key]

    # Cached properties are not fields, and so are free of the class's being frozen.
    @functools.cached_property
    def _kept(self) -> dict[tuple[Any, ...], Any]:
        return {}

    @functools.cached_property
    def coefficients(self) -> Coefficients:
        """The coefficients of the reduced equations of the body, in the map's unit."""
        return self._coefficients(precision(self.bits))

    def _coefficients(self, a: Precision) -> Coefficients:
        return coefficients(self.body.angles(a.bits + GUARD_BITS), self.design.unit, a)

    def midline(self, rising: bool, chi: Scalar, energy: Scalar, a: Precision) -> Any:
        """d of a midline at points of the section, (N,), in numbers of any precision.

        `energy`, (N,) or (1,), goes from -1 to 1 over the map's interval.
        """
        whole = Interval(a.number(0), a.number(1), 1)
        return self.midlines[rising].at(a.cos(chi), energy, 1, whole, a)

    def placed(self, rising: bool, states: Numbers, energy: Scalar) -> tuple[Any, Any, Any]:
        """The coordinates d/width and chi of states of the section, and their side, (N,) each.

        States are (6, N), dimensionless, M in the map's unit; `energy`, (N,), goes from -1 to 1
        over the map's interval. The side is as in `poincare.section_point`.
        """
        # Twice as many bits more as d loses with its midline.
        narrower, own = self.design.narrower, precision(self.bits)
        a = in_sums(self.bits + 2 * narrower) if narrower else own
        d, chi, side = section_point(rising, a.array(states), self._coefficients(a), a)
        if narrower:
            d = d - self.midline(rising, chi, a.array(energy), a)
        return own.array(d) * (1 / self.charts[rising].forward.width), own.array(chi), side


@functools.lru_cache(maxsize=256)
def expected_cost(body: Body, low: Exact, high: Exact, bits: int, design: Design) -> float:
    """Expected seconds of a core for building a map, if the planned orders suffice.

    Raises MapError if there is no map.
    """
    layer, planned = plan(body, low, high, bits, design)
    a, rough = precision(table_bits(bits)), _rough(body, (low + high) / 2, design)
    return building_seconds(rough, planned, a, _of_arcs(a, layer, design), theta3=design.theta3)


def _rough(body: Body, h: Exact, design: Design) -> Rough:
    """Sizes and rates of a body's orbits at an energy, in the unit of a design."""
    c = coefficients(body.angles(), design.unit, precision(53))
    return Rough(c, float(h * exact(design.unit) ** 2))


Plan: TypeAlias = tuple[Layer, Orders]
"""Layer and orders of a map that is to be built: the widths and the sizes of its tables."""


def plan(body: Body, low: Exact, high: Exact, bits: int, design: Design) -> Plan:
    """The plan of a map, from two looks at its body; MapError if there is no map."""
    ends = float(low), float(high)
    found = _looked(body, *ends, design.narrower)
    if isinstance(found, MapError):
        # A new one, because an exception that is kept would gather the traces of all its raises.
        raise MapError(str(found))
    unit, half = float(design.unit), (ends[1] - ends[0]) / 2
    planned = orders(found[0], half, *found[1:], *_left_out(bits, design))
    return found[1].in_unit(unit), planned.designed(unit, design.arc_stretch, design.more_terms)


def _left_out(bits: int, design: Design) -> tuple[float, float]:
    """The sizes of the first terms to be left out of tables and of the normal form, relative."""
    rounding = 2.0**-bits
    if _allowed(bits) > rounding:
        # Terms below the roundings of a finished map gain nothing.
        return rounding, LEAST_ROUNDINGS * rounding
    margin = MARGIN_BITS + (NARROW_BITS if design.narrower else 0)
    return 2.0 ** -(table_bits(bits) + margin), rounding / INNER


def _allowed(bits: int) -> float:
    """The largest error that a finished map may have, relative."""
    # A rounding where its tables are sharper, other than in doubles.
    return 2.0**-bits * (ALLOWED_ROUNDINGS if bits in (53, table_bits(bits)) else 1.0)


@functools.lru_cache(maxsize=64)
def _looked(
    body: Body, low: float, high: float, narrower: int
) -> tuple[Rough, Layer, Shrinking] | MapError:
    """The two looks at a body, in the unit of the first design; or the reason against a map.

    Maps of all precisions and designs share them; a reason is returned so that it is kept too.
    """
    try:
        rough = _rough(body, exact((low + high) / 2), FIRST)
        _floquet_exponent(body, low, high)

        def sharp(a: Precision) -> Coefficients:
            return coefficients(body.angles(a.bits + GUARD_BITS), FIRST.unit, a)

        return rough, *looks(rough, (high - low) / 2, narrower, sharp)
    except MapError as refused:
        return refused


def build(
    body: Body,
    low: Exact,
    high: Exact,
    bits: int,
    design: Design = FIRST,
    budget: float = math.inf,
    by: Plan | None = None,
) -> ReturnMap:
    """Build the map of a body for energies from `low` to `high`, by the plan `by` if it is given.

    Orders are raised from attempt to attempt until the measured errors are allowed.

    Raises
    ------
    MapError
        The map does not resolve the orbits there; the message gives the reason.
    Costly
        Building it is expected to take more than the budget, seconds of a core.
    """
    a = precision(table_bits(bits))
    # Digits for the sharpest tables that a later attempt may turn to.
    p = body.angles(
        max(a.bits, MOST_IN_TRIPLES if design.narrower else MOST_IN_PAIRS) + 2 * GUARD_BITS
    )
    rough = _rough(body, (low + high) / 2, design)
    exponent, allowed = _floquet_exponent(body, float(low), float(high)), _allowed(bits)
    layer, planned = by or plan(body, low, high, bits, design)
    # Exact up to here: each of them is rounded once.
    middle, half = (x / 2 * exact(design.unit) ** 2 for x in (low + high, high - low))
    spent, before = 0.0, math.inf
    for attempt in itertools.count(1):
        sharp = _of_arcs(a, layer, design)
        spent += building_seconds(rough, planned, a, sharp, theta3=design.theta3)
        if spent > budget:
            raise Costly(spent, budget)
        energies = Interval(a.number(middle), a.number(half), planned.n_energy)
        c = coefficients(p, design.unit, sharp)
        arcs = Arcs(a.number(planned.length), c, sharp, layer.midlines)
        sizes = planned.degree, planned.n_phase_orbit, rough.border(max(layer.widths))
        nf = normal_form(rounded(arcs.c, a), energies, *sizes, a, theta3=design.theta3)
        nodes = planned.n_x, planned.n_phase, planned.n_phase_inverse
        charts = section_charts(layer, *nodes, nf, arcs, a)
        errors = measured(charts, nf, arcs, exponent, a)
        if errors.largest < allowed:
            break
        # Where more terms give nothing roundings decide, and no more terms are tried.
        idle = a.parts == 2 and errors.largest > before / 2
        if attempt == ATTEMPTS or (idle and a.bits == MOST_IN_PAIRS):
            raise MapError(
                f"the tables don't settle: in the last of {attempt} attempts they err by"
                f" {errors.largest:.2g} of their largest values, and {allowed:.2g} is allowed"
            )
        if idle:
            # Where the surfaces split by little, one of a chart's four functions is so small that
            # the roundings of the others, larger ones show in it.
            a = precision(MOST_IN_PAIRS)
        before, planned = errors.largest, planned.larger(errors, allowed)
    if errors.floquet > FLOQUET:
        raise MapError(f"Lambda_0 differs from the Floquet exponent by {errors.floquet:.2g}")
    own = precision(bits)
    return ReturnMap(
        body,
        bits,
        (low, high),
        errors,
        planned,
        design,
        rounded(nf, own),
        (rounded(charts[0], own), rounded(charts[1], own)),
        layer.midlines,
        spent,
    )


def _of_arcs(a: Precision, layer: Layer, design: Design) -> Precision:
    """The precision of arcs, for tables of the precision `a`."""
    if not design.narrower:
        return a
    # States are of the order of one, and d less the midline of that of the width.
    return in_sums(a.bits - math.log2(min(layer.widths)))


def _floquet_exponent(body: Body, low: float, high: float) -> float:
    """The Floquet exponent per radian of psi in the middle of the interval.

    Raises MapError if there or at either end the periodic orbit is not hyperbolic, or turns in
    theta1: with an odd number of turns its multiplier is negative.
    """
    found = []
    for h in (low, (low + high) / 2, high):
        try:
            orbit = floquet.periodic_orbit(body.angles(113), h, 2, 1)
        except (ArithmeticError, ValueError) as error:
            raise MapError(f"at the energy {h:.6g}: {error}") from None
        if orbit.turns:
            raise MapError(
                f"at the energy {h:.6g} theta1 turns {orbit.turns} times in a period: "
                "the normal form is that of orbits along which it does not; take less weight"
            )
        found.append(orbit.exponent_per_period / (2 * math.pi))
    return abs(found[1])


def table_bits(bits: int) -> int:
    """The number of bits of a map's tables: more than its own while pairs of doubles hold them.

    Sharper tables make a sharper map, in doubles too.
    """
    return bits + SPARE_BITS if bits + SPARE_BITS <= MOST_IN_PAIRS else bits
