"""Experiment `full_shift`: four sets that cover each other, and the proof that they do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.config.description import Row, body_rows
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import compare
from rigidpend.experiments.data.layout import datasets
from rigidpend.experiments.data.tree import Data, Tree
from rigidpend.experiments.full_shift.layout import DRAWN, PROOF, QUADS, RELATIONS

if TYPE_CHECKING:
    from rigidpend.experiments.full_shift.schema import Config
    from rigidpend.routes.certified.coverings import Arrival, Relation
    from rigidpend.routes.certified.families import Family
    from rigidpend.routes.certified.pieces import Quad

Array = NDArray[np.float64]

SIDE = 40
"""Points on a side of an outline."""
SECONDS = 6.0
"""Seconds that a proof takes."""
SHARE = 1e-6
"""Allowed difference of sets, of the largest: the map errs by 1e-16 in d."""
MARGIN = 0.05
"""That of bounds, and of margins that they leave: what is rounded in polynomials hangs on chance."""
BOUNDS = ("bound", "late", "across")
UNDECIDED = "undecided, nothing is proven"


def compute(config: Config, means: Means) -> Tree:
    """Find the sets and the polynomials of their orbits, and check what they prove."""
    # Behind a function, for only this experiment needs the extra `certified`.
    from rigidpend.routes.certified import extra as extra  # isort: skip
    from rigidpend.orbits.return_map import MapError
    from rigidpend.routes.certified import horseshoe, pieces
    from rigidpend.routes.certified.checker import Undecided

    problem = config.problem
    setting = horseshoe.Setting(problem.body, problem.h, problem.half_turns)
    try:
        sets = horseshoe.quads(setting)
        means.report("four sets are found, and their orbits follow")
        orbits = [horseshoe.pieces(setting, quad) for quad in sets]
        quads, proof = pieces.packed_quads(sets), pieces.packed(orbits)
        found, relations = checked(config, quads, proof)
    except (MapError, ArithmeticError, Undecided) as doubt:
        raise ArithmeticError(f"{UNDECIDED}: {doubt}") from None
    means.report("every code occurs: 8 of 8 covering relations are proven")
    rows = [
        {name: [getattr(one, name) for one in pair] for name in RELATIONS} for pair in relations
    ]
    return {
        "sets": datasets(QUADS, quads | _of_sets(found)),
        "relations": datasets(
            RELATIONS, {name: np.array([row[name] for row in rows]) for name in RELATIONS}
        ),
        "proof": datasets(PROOF, proof),
        "drawn": datasets(DRAWN, _drawn(sets, found)),
    }


def checked(config: Config, quads: Data, proof: Data) -> tuple[list[Arrival], list[list[Relation]]]:
    """Check the proof of a result without integration: what it proves.

    Parameters
    ----------
    config : Config
    quads, proof : Data
        The groups `sets` and `proof` of a result.

    Raises
    ------
    Undecided
        Something is not shown; the text says what.
    """
    from rigidpend.routes.certified import coverings, pieces

    sets = pieces.unpacked_quads(quads)
    orbits = pieces.unpacked(proof, len(sets))
    return coverings.prove(
        coverings.Numbers.of(config.problem.body, config.problem.h), sets, orbits
    )


def _of_sets(found: Sequence[Arrival]) -> dict[str, Any]:
    return {
        "symbol": np.array([int(each.right) for each in found]),
        "bound": np.array([each.bound for each in found]),
        "late": np.array([each.late for each in found]),
        "shortest": np.array([each.duration[0] for each in found]),
        "longest": np.array([each.duration[1] for each in found]),
    }


def _drawn(sets: Sequence[Quad], found: Sequence[Arrival]) -> dict[str, Array]:
    """Outlines of the sets and of their images, as the polynomials have them."""
    from rigidpend.routes.certified.coverings import place

    side, one = np.linspace(-1, 1, SIDE), np.ones(SIDE)
    u = np.concatenate((side, one, -side, -one))
    v = np.concatenate((-one, side, one, -side))
    rows: dict[str, list[Array]] = {name: [] for name in DRAWN}
    for quad, arrival in zip(sets, found, strict=True):
        for rising, prefix, where in (
            (quad.rising, "", place(quad)),
            (not quad.rising, "image_", (arrival.d, arrival.g)),
        ):
            d, g = (_values(each, u, v) for each in where)
            # The sets of a section lie on either side of its stable surface, equally far.
            curves = [np.array(q.p, dtype=float) for q in sets if q.rising == rising]
            surface = np.polynomial.polynomial.polyval(g, np.mean(curves, axis=0))
            rows[f"{prefix}chi"].append(-np.arcsin(g))
            rows[f"{prefix}d"].append(d - surface)
    return {name: np.array(each) for name, each in rows.items()}


def _values(family: Family, u: Array, v: Array) -> Array:
    terms = family.doubled.to_dict().items()
    unit = 2.0 ** -(family.bits + 1)
    return np.asarray(sum(int(w) * unit * u ** int(k) * v ** int(l) for (_, k, l), w in terms))


def cost(config: Config) -> float:
    """Estimate of the seconds that a proof takes."""
    return SECONDS


def describe(config: Config) -> list[Row]:
    """Describe a config in rows, with what follows from it, units named."""
    problem = config.problem
    return [
        *body_rows(problem.body),
        Row("h", str(problem.h), "energy of the orbits"),
        Row("half_turns", str(problem.half_turns), "half rotations of every passage"),
        Row("relations", "8", "to be proven: each of four sets covers two"),
    ]


def differences(stored: Data, fresh: Data) -> list[compare.Difference]:
    """Find where two results disagree: both prove the same relations, of the same sets.

    Polynomials are not compared: those of the fresh result were checked when it was made, and
    their last digits differ from one processor to another.
    """
    found = compare.keys(stored, fresh)
    for group in (name for name in ("sets", "relations", "drawn") if name in fresh):
        for name in stored[group]:
            old, new = stored[group][name], fresh[group].get(name)
            if new is not None and name != "edge":
                share = MARGIN if name in BOUNDS else SHARE
                allowed = share * float(np.abs(old).max())
                found += compare.arrays(f"{group}/{name}", old, new, allowed)
        found += compare.keys(stored[group], fresh[group], group)
    found += compare.beyond("relations/across", fresh["relations"]["across"], 1.0)
    # What an edge is in the far narrower target hangs on the last digits: only that it is beyond.
    found += compare.beyond("relations/edge, its inverse", 1 / fresh["relations"]["edge"], 1.0)
    return found
