"""Fields that experiments share: arrays of route codes (itineraries), proofs, series over mu."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidpend.experiments.compare import ROUNDING, relative, where
from rigidpend.experiments.data import ANY, Allowed, Data, double, flag, text, whole
from rigidpend.numbers import Array
from rigidpend.numbers.texts import NO_SYMBOL

if TYPE_CHECKING:
    from fractions import Fraction

    from rigidpend.config.bodies import WeightedBodies
    from rigidpend.numbers.exact import Exact


CODES = 0, 1, NO_SYMBOL
"""Values of symbols: left, right, none."""
SYMBOLS, CROSSINGS = ("symbols", "columns"), ("symbols+1", "columns")

AT_FIRST, AT_SECOND, GROWTH = 1e-12, 1e-8, 3.5
"""Allowed difference of the times of crossings 1 and 2, t', and its growth per later crossing."""
TIME_GAP = 0.02
"""Largest allowed difference of the times of certain crossings, t'.

Each of two results may err by a hundredth, far less than the radian of the phase that changes a
symbol."""


def arrays(data: Data) -> Data:
    """The groups of a result that may hold arrays of codes; those of a zoom are its levels."""
    levels: Data = data.get("levels", {})
    # A config may give this name to an array too.
    return levels if levels and "codes" not in levels else data


def crossing_tolerance(crossings: int, growth: float = GROWTH) -> Array:
    """Allowed difference of the times of each of so many crossings, t', (crossings, 1).

    On the way to the first crossing a relative error does not grow. In a passage at a distance d
    it grows by 1/d, which is exp(u T/2) where T is the time of the passage, and T by its logarithm.
    Between scalar and batched, full and compact builds the largest difference of 4,000 random
    phases (body of Fig. 4) was 4e-15 at the first crossing, 2e-11 at the second, and then grew
    by 3.4 a crossing, to 5e-4 at the sixteenth; DOP853 is ten times as far off. The bound ends at
    `TIME_GAP`, since certain symbols exclude more.
    """
    # In logarithms, because the power of a thousand crossings overflows.
    exponent = np.log(AT_SECOND) + np.log(growth) * np.arange(crossings - 1.0)
    grown = np.minimum(np.exp(np.minimum(exponent, 0.0)), TIME_GAP)
    return np.concatenate(([AT_FIRST], grown))[:, None]


kept = where(lambda stored, fresh: stored["certain"])
"""Bound of certainty: symbols may become certain, but none may cease to be."""
known = where(lambda stored, fresh: stored["certain"] & fresh["certain"])
"""Bound of symbols: they must be equal where both results are certain."""


def crossed(within: Callable[[int], Any]) -> Allowed:
    """Bound of crossings: `within` of their number, at certain symbols only."""

    def allowed(name: str, stored: Data, fresh: Data) -> Any:
        certain = stored["certain"] & fresh["certain"]
        # A crossing is as certain as the symbol that it ends. The first crossing ends
        # none, and is as certain as the symbol that it begins.
        after = np.vstack((certain[:1], certain))
        return np.where(after, within(len(after)), np.inf)

    return allowed


MEANING = {
    "theta2_0": double(
        "rad",
        "initial phase of each column, rounded to a double; exactly start + k step of the config",
        "columns",
        within=ROUNDING,
        symbol=r"$\theta_2^0$",
        coordinate=True,
    ),
    "codes": whole(
        "1",
        "symbols, row 0 = symbol 1: 0 left, 1 right, 255 none (no return)",
        *SYMBOLS,
        within=known,
        among=CODES,
    ),
    "certain": flag(
        "1", "whether two independent computations establish the symbol", *SYMBOLS, within=kept
    ),
    "bits": whole("bit", "precision that decided the column", "columns", within=ANY),
    "crossing_time": double(
        "t' = t s",
        "times of the crossings of J1 = J2/2, NaN where there is none",
        *CROSSINGS,
        gaps=True,
        within=crossed(crossing_tolerance),
    ),
    "separatrix": whole(
        "1",
        "separatrix beside which the crossing lies, 1..4, 0 for none",
        *CROSSINGS,
        within=crossed(lambda crossings: 0.0),
        among=tuple(range(5)),
    ),
}
"""Fields of an array of route codes."""

_step = partial(whole, "1", dimensions=("steps",), within=ANY)
# Their last digits differ between processors: only what they prove is compared.
STEPS = {
    "family": _step("the family of orbits of which a step is, counted from 0"),
    "bits": _step("its coefficients are in units of 2^-bits"),
    "terms": _step("number of its terms"),
    "powers": whole(
        "1",
        "j, k, l of T_j(x) u^k v^l; or j, k, l, m of T_j(x) u^k v^l w^m",
        "terms",
        "powers",
        within=ANY,
    ),
    "coefficients": whole(
        "1",
        "of Qp, Qm, M3, gamma1, gamma2, gamma3, and of half of the length in time in 2^-50 t';"
        " twice as large where j = 0",
        "terms",
        7,
        within=ANY,
    ),
}
"""Fields of the polynomials that prove a result's statements on families of orbits."""


EACH = ("bodies", "mu")
"""Dimensions of a field with a value for each body at each weight."""
NAME = text("text", "(bodies,): as in the config", "bodies", coordinate=True)
RATIO = 1e-13
"""Allowed relative difference of a quotient."""
MU_OVER_H0 = double(
    "1", "weight over energy", "mu", within=relative(RATIO), symbol=r"$\mu/h_0$", coordinate=True
)
SMALL = 1e-2
"""Largest mu/h0 at which slopes are fitted: above it the next order in mu is visible."""


def rational(number: Exact) -> Fraction:
    """The fraction of a number that the schema has checked to be rational."""
    assert number.fraction is not None
    return number.fraction


def attributes(names: Iterable[str], rows: Sequence[Any]) -> dict[str, Array]:
    """Attributes of records as arrays, by name."""
    return {name: np.array([getattr(row, name) for row in rows]) for name in names}


def stacked(found: Mapping[str, Any]) -> dict[str, Any]:
    """Stack the fields of all bodies, given by name, along a first axis; with their names."""
    first, *_ = found.values()
    each = {key: np.array([body[key] for body in found.values()]) for key in first}
    return {"name": list(found), **each}


def mu_over_h0(problem: WeightedBodies) -> Array:
    """Ratio of weight and energy, the small parameter of the series, for every weight."""
    return np.array([float(mu / problem.h0) for mu in problem.mu])


def slope_weights(ratio: Array, values: Array, floor: Array | float = 0.0) -> Array:
    """Weights (n,) of log(values) in the slope over log(mu), which least squares fit.

    They are 0 for values at mu/h0 above `SMALL`, and for values up to `floor`, which are rounding.
    All are 0 for fewer than two points.
    """
    kept = (ratio <= SMALL) & (values > floor)
    weights = np.zeros(len(ratio))
    if kept.sum() > 1:
        off = np.log(ratio[kept]) - np.log(ratio[kept]).mean()
        weights[kept] = off / (off @ off)
    return weights


def slope(ratio: Array, values: Array, floor: Array | float = 0.0) -> float:
    """Fit the slope of log(values) over log(mu) by :func:`slope_weights`; NaN if all are 0."""
    weights = slope_weights(ratio, values, floor)
    fitted = weights != 0
    return float(weights[fitted] @ np.log(values[fitted])) if fitted.any() else float("nan")
