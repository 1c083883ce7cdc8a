"""Covering relations, each with the margin by which it holds."""

from __future__ import annotations

import math
from decimal import ROUND_CEILING, ROUND_FLOOR, Context

import numpy as np

from rigidpend.experiments.data.tree import Data, Loaded
from rigidpend.machine.tables import Table

CAPTION = (
    "Each image, a pale strip, crosses all sets of its panel, the full ones, from end to end, as"
    " in a horseshoe. The sets lie on the section J1 = J2/2, of upward and of downward"
    " crossings, and the images are those after one passage. That they cross is proven, and from"
    " it follows that every sequence of 0 and 1 is the route code of an orbit in the sets (each"
    " sequence of sets that of one alone where C7 holds), and every periodic one that of a closed"
    " orbit. A line of starts of one J1_0 crosses those of a section too: every one-sided sequence"
    " is the code of one of them, behind that of its approach; where C8 holds every finite sequence"
    " is that of an orbit from the lower periodic orbit to the upper or the lower one, and of one"
    " from the upper one. What looks like a line in the upper panels is a set: below, one"
    " crossing is magnified."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the relations, and that of the sets."""
    data = result["data"]
    sets, relations, line = data["sets"], data["relations"], data["line"]
    names = [_name(sets, k) for k in range(len(sets["rising"]))]
    pairs = math.prod(np.unique(sets["rising"], return_counts=True)[1])
    return [
        Table(
            "Covering relations, all proven",
            ("set", "covers", "|U| of the ends' images", "|V| of the image", "stretch", "squeeze"),
            [
                (
                    names[k],
                    names[relations["target"][k][j]],
                    f"more than {_below(relations['edge'][k][j], 4)}",
                    f"less than {_above(relations['across'][k][j], 4)}",
                    f"more than {_below(relations['stretch'][k][j], 4)}",
                    f"less than {_above(relations['squeeze'][k][j], 4)}",
                )
                for k, j in np.ndindex(relations["target"].shape)
            ],
            "A relation needs more than 1 and less than 1. The stretch is |dU/du| - |dU/dv|, the"
            " squeeze |dV/du| + |dV/dv|: more than 1 and less than 1 make the orbit of a sequence"
            " the only one in the sets. The line of starts, with theta2_0 from"
            f" {line['theta2'][0]:.5f} to {line['theta2'][1]:.5f}, crosses those of a section"
            f" too{_behind(data)}: more than {_below(min(line['edge']), 4)}, less than"
            f" {_above(max(line['across']), 4)}; stretch more than"
            f" {_below(min(line['stretch']), 4)}, squeeze less than"
            f" {_above(max(line['squeeze']), 4)}.",
        ),
        Table(
            "Sets and passages from them",
            ("set", "half width in d", "bound on the distance", "time of a passage (t')"),
            [
                (
                    names[k],
                    f"{sets['a'][k]:.3g}",
                    _above(sets["bound"][k], 2),
                    f"{_below(sets['shortest'][k], 6)} to {_above(sets['longest'][k], 6)}",
                )
                for k in range(len(names))
            ],
            f"The topological entropy is at least ln({pairs})/2 a passage, and at least"
            f" {_below(entropy(sets), 4)} a unit of t'.{_energies(result)}",
        ),
    ]


def entropy(sets: Data) -> float:
    """The bound of Theorem 10, from the largest times of passages: a unit of t', rounded down."""
    low, high = 0.0, 1.0
    while low < (middle := (low + high) / 2) < high:
        weights = np.exp(-middle * sets["longest"])
        total = weights[sets["rising"]].sum() * weights[~sets["rising"]].sum()
        low, high = (middle, high) if total > 1 else (low, middle)
    return low


def _behind(data: Data) -> str:
    """Words on the approach of a line of starts."""
    if "approach" not in data:
        return ""
    return f" after the symbols {''.join(map(str, data['approach']['symbol']))}"


def _energies(result: Loaded) -> str:
    """A sentence on the energies, where there are several."""
    found, given = result["data"].get("energies"), result["config"]["problem"]
    if found is None:
        return ""
    middle = "h" if given.get("h") is not None else f"h0 + {float(found['shift'])!r}"
    return (
        f" All of this is of every energy that differs from {middle} by at most"
        f" {float(found['spread'])!r}, with sets that move with it; drawn are those of the middle."
    )


def _below(x: float, digits: int) -> str:
    """A lower bound as text, rounded down."""
    return f"{Context(digits, ROUND_FLOOR).create_decimal_from_float(float(x)):g}"


def _above(x: float, digits: int) -> str:
    """An upper bound as text, rounded up."""
    return f"{Context(digits, ROUND_CEILING).create_decimal_from_float(float(x)):g}"


def _name(sets: Data, k: int) -> str:
    return f"{'upward' if sets['rising'][k] else 'downward'}, symbol {sets['symbol'][k]}"
