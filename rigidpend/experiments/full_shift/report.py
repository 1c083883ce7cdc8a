"""Covering relations, each with the margin by which it holds."""

from __future__ import annotations

import math

from rigidpend.experiments.data.tree import Data, Loaded
from rigidpend.machine.tables import Table

CAPTION = (
    "Each image, a pale strip, crosses both sets of its panel, the full ones, from end to end, as"
    " in a horseshoe. The sets lie on the section J1 = J2/2, two for upward and two for downward"
    " crossings, and the images are those after one passage. That they cross is proven, and from"
    " it follows that every sequence of 0 and 1 is the route code of an orbit, and every periodic"
    " sequence that of a closed one. A line of starts of one J1_0 crosses both upward sets too:"
    " every one-sided sequence is the code of one of them. What looks like a line in the upper"
    " panels is a set: below, one crossing is magnified."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the relations, and that of the sets."""
    data = result["data"]
    sets, relations, line = data["sets"], data["relations"], data["line"]
    names = [_name(sets, k) for k in range(len(sets["rising"]))]
    entropy = math.log(2) / max(sets["longest"])
    return [
        Table(
            "Covering relations, all proven",
            ("set", "covers", "|U| of the ends' images", "|V| of the image"),
            [
                (
                    names[k],
                    names[relations["target"][k][j]],
                    f"more than {relations['edge'][k][j]:.4g}",
                    f"less than {relations['across'][k][j]:.4f}",
                )
                for k in range(len(names))
                for j in range(2)
            ],
            "A relation needs more than 1 and less than 1. The line of starts, with theta2_0 from"
            f" {line['theta2'][0]:.5f} to {line['theta2'][1]:.5f}, crosses both upward ones too:"
            f" more than {min(line['edge']):.4g}, less than {max(line['across']):.4f}.",
        ),
        Table(
            "Sets and passages from them",
            ("set", "half width in d", "bound on the distance", "time of a passage (t')"),
            [
                (
                    names[k],
                    f"{sets['a'][k]:.3g}",
                    f"{sets['bound'][k]:.2g}",
                    f"{sets['shortest'][k]:.4f} to {sets['longest'][k]:.4f}",
                )
                for k in range(len(names))
            ],
            "The topological entropy is at least ln 2 a passage, so at least"
            f" {math.floor(entropy * 1e5) / 1e5:.5f} a unit of t'.",
        ),
    ]


def _name(sets: Data, k: int) -> str:
    return f"{'upward' if sets['rising'][k] else 'downward'}, symbol {sets['symbol'][k]}"
