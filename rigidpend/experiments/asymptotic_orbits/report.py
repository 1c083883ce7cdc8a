"""Doubly asymptotic orbits counted by the symbols of their codes, and the shortest of them."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from rigidpend.experiments.data.tree import Data, Loaded
from rigidpend.machine.tables import Table

CAPTION = (
    "Where a symbol of the route codes changes lies an orbit that never leaves again: a"
    " homoclinic one, which returns to the periodic orbit that it came from, or a heteroclinic"
    " one, which goes to the other. Row i + 1 of the plane has the orbits with i symbols, as far"
    " as no passage takes too many rotations. The hodographs of the sampled orbits begin and end"
    " at the origin, where omega is horizontal along eta."
)
ROWS = 24
"""Orbits that have a row of their own: the first in the order of symbols and phases."""


def tables(result: Loaded) -> list[Table]:
    """Table of the counts, and that of the first orbits."""
    lengths = sorted(result["data"]["orbits"].items(), key=lambda pair: int(pair[0]))
    each = [(orbits, k) for _, orbits in lengths for k in range(len(orbits["theta2_0"]))]
    first = [_row(*one) for one in each[:ROWS]]
    return [
        Table(
            "Doubly asymptotic orbits by the symbols of their codes",
            ("symbols", "orbits", "kind", "arcs searched", "largest residual", "map's error (rad)"),
            [_count(name, orbits) for name, orbits in lengths],
            "All leave the lower periodic orbit. The map's error is that of theta2_0 in doubles,"
            " against integration in 106 bits.",
        ),
        Table(
            "The first orbits",
            ("address", "kind", "theta2_0 (rad)", "flight (t')", "theta3+ - theta3- (rad)"),
            first,
            f"{len(first)} of {len(each)}. theta2_0 is theta2 where J1 = J1_0.",
        ),
    ]


def _count(name: str, orbits: Data) -> tuple[str, ...]:
    count = len(orbits["theta2_0"])
    residual, moved = (float(np.abs(orbits[key]).max(initial=0.0)) for key in ("residual", "moved"))
    ends, arcs = str(orbits["ends"]), str(int(orbits["arcs"]))
    return name, str(count), ends, arcs, f"{residual:.0e}", f"{moved:.0e}"


def _row(orbits: Data, k: int) -> tuple[str, ...]:
    phase = digits(float(orbits["theta2_0"][k]), float(orbits["theta2_0_rest"][k]))
    numbers = f"{orbits['flight'][k]:.9f}", f"{orbits['theta3'][k]:.12f}"
    return address(orbits, k), str(orbits["ends"]), phase, *numbers


def address(orbits: Data, k: int) -> str:
    """The address of an orbit: its first cell, and each symbol with its half rotations."""
    terms = zip(orbits["word"][:, k], orbits["half_turns"][:, k], strict=True)
    return " ".join(["ab"[int(orbits["first"][k])], *(f"{s}^{n}" for s, n in terms)])


def digits(high: float, rest: float, places: int = 29) -> str:
    """The sum of two doubles to so many digits behind the point."""
    whole = round((Fraction(high) + Fraction(rest)) * 10**places)
    text = str(whole).rjust(places + 1, "0")
    return f"{text[:-places]}.{text[-places:]}"
