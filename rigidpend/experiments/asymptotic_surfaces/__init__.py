"""Asymptotic surfaces (stable, unstable manifolds) of several bodies: Fig. 3 and Table 1."""

import itertools
from typing import Any

import numpy as np

from rigidpend.experiments import compare
from rigidpend.experiments.compare import ROUNDING, Difference, modulo, relative
from rigidpend.experiments.data import Data, Field, Layout, double, held, whole

DRIFT = 1e-12
"""Allowed difference of theta1 (radians) and J1/J2 where orbits neither approach nor leave."""
LATE = 20_000
"""Samples after which rounding adds to that: with heavy bodies as much after 15,000 to 30,000."""
NEAREST = 1e-12
"""Ratio J1/J2, or 1 - J1/J2, of which rounding leaves some digits."""
SHARED = 0.9
"""Least share of the points of two results that must be at the same times."""

ANGLES = {
    "alpha0": double("rad", "alpha0 of each body, in the order of the bodies", "bodies"),
    "gamma0": double("rad", "gamma0 of each body", "bodies"),
    "nu": double("1", "pi kappa/sin(alpha0) of each body", "bodies"),
}
"""Columns of Table 1, with nu by which the paper orders its panels."""
WINDOW = {
    "centre": double("rad", "alpha0 + beta0, theta1 on separatrix 2"),
    "Delta_1": double("rad", "largest |theta1 - alpha0 - beta0| near T1 and T2, eq. (dt)"),
    "born": double("rad", "centre -+ Delta_1", 2),
    "window": double("rad", "centre -+ half_width Delta_1", 2),
    "time_step": double("t' = t s", "step between samples"),
}
"""Fields of the window that a body's two panels show."""


def _shared(stored: Data, fresh: Data) -> Any:
    """Places of stored points among the fresh ones, by orbit and time; -1 for none.

    Rounding may decide which of the samples of a curve are stored. Without sound offsets, which
    are told apart, there is none.
    """
    at = np.full(len(stored["sample"]), -1)
    if _ends("offsets", stored, fresh):
        return at
    # intersect1d takes no pairs: curve and time become one integer, with times below 2^31.
    first, second = (
        np.repeat(np.arange(len(x["offsets"]) - 1), np.diff(x["offsets"])) * 2**32 + x["sample"]
        for x in (stored, fresh)
    )
    _, here, there = np.intersect1d(first, second, return_indices=True)
    at[here] = there
    return at


def _ends(name: str, stored: Data, fresh: Data) -> list[Difference]:
    """Bound of the offsets: they must begin at 0 and end at the number of points."""
    return compare.arrays(name, [0, len(fresh["theta1"])], fresh[name][[0, -1]])


def _times(name: str, stored: Data, fresh: Data) -> list[Difference]:
    """Bound of the times: most must be common, or two results would agree on few points."""
    points, shared = len(stored[name]), int((_shared(stored, fresh) >= 0).sum())
    if shared >= SHARED * max(points, len(fresh[name])):
        return []
    said = f": only {shared} of {points} points are at the same times"
    return [Difference(name, points, shared, words=said)]


def _points(name: str, stored: Data, fresh: Data) -> list[Difference]:
    """Bound of the points; at first theta1 errs as J2^2/(J1 (J2 - J1)), by eq. (dtheta)."""
    J1, at = stored["J1_over_J2"], _shared(stored, fresh)
    # In units of its value at the section, where the root is 1; of the phase it grows as t^1.5.
    root, late = np.sqrt(4 * J1 * (1 - J1)), (1 + stored["sample"] / LATE) ** 1.5
    # A ratio may round to 1, and errors may outgrow doubles.
    with np.errstate(all="ignore"):
        grown = np.fmax(_grown(stored), 1 / root)
        drift = DRIFT * late * (grown / root if name == "theta1" else np.fmax(1, grown * root))
    return compare.arrays(name, stored[name], fresh[name][at], np.where(at < 0, np.inf, drift))


def _grown(stored: Data) -> Any:
    """Largest growth of an error of Qp and Qm since its curve crossed J1 = J2/2; 0 before that.

    Its rate is at most u |J1/J2 - 1/2|. Up to the crossing ln(J1/(J2 - J1)) grows at the rate u.
    """
    grown = np.zeros(len(stored["sample"]))
    for first, end in itertools.pairwise(stored["offsets"]):
        J1, time = (stored[name][first:end] for name in ("J1_over_J2", "sample"))
        k = int(np.argmax((J1 > 0.5) != (J1[:1] > 0.5))) if end > first else 0
        if k:
            # The surface may begin closer to J1 = 0 or J1 = J2 than the ratio tells.
            begun = min(k - 1, int(np.argmax(J1 * (1 - J1) > NEAREST)))
            near = np.clip(J1[[begun, k]], NEAREST, 1 - NEAREST)
            rate = abs(np.diff(np.log(near / (1 - near)))[0]) / (time[k] - time[begun])
            off = np.abs(J1[k:] - 0.5)
            steps = rate * np.diff(time[k:]) * (off[1:] + off[:-1]) / 2
            grown[first + k : end] = np.exp(np.append(0, np.cumsum(steps)))
    return grown


def _curves(name: str) -> dict[str, Field]:
    """The curves of one surface, with dimensions of their own."""
    points, orbits = f"points of {name}", f"orbits of {name}"
    along, when = ({"within": each, "sized": False} for each in (_points, _times))
    turned = modulo(2 * np.pi, lambda name, stored, fresh: 1e3 * ROUNDING)
    said, counted = "all curves, one after the other", "time of each point in time_step"
    return {
        "theta1": double("rad", said, points, **along),
        "J1_over_J2": double("1", said, points, **along, symbol="$J_1/J_2$"),
        "sample": whole("1", f"{counted}, from the start; S2+ runs backward", points, **when),
        "offsets": whole("1", "curve k is offsets[k]:offsets[k + 1]", f"{orbits}+1", within=_ends),
        "theta2_0": double("rad", "theta2 at the start of each orbit", orbits, within=turned),
    }


CURVES = {name: _curves(name) for name in ("S1_minus", "S2_plus")}
"""Fields of each surface; its dimensions have their own names, as numbers of points differ."""

BODY: Layout = {**WINDOW, **CURVES}
LAYOUT = held(relative(ROUNDING), {"table": ANGLES, "bodies": {"<bodies>": BODY}})
