"""Experiment `full_shift`: four sets that cover each other, and the proof that they do."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.contract import Means
from rigidpend.experiments.data.layout import datasets
from rigidpend.experiments.data.tree import Data, Tree
from rigidpend.experiments.full_shift.layout import DRAWN, ENERGIES, LINE, PROOF, QUADS, RELATIONS
from rigidpend.numbers.exact import exact

if TYPE_CHECKING:
    from rigidpend.experiments.full_shift.schema import Config
    from rigidpend.routes.certified.coverings import Numbers, Reached, Relation
    from rigidpend.routes.certified.families import Family
    from rigidpend.routes.certified.horseshoe import ShiftProblem
    from rigidpend.routes.certified.pieces import Quad

Array = NDArray[np.float64]

SIDE = 24
"""Points on a side of an outline."""
SECONDS = 6.0
"""Seconds that a proof takes."""
UNDECIDED = "undecided, nothing is proven"
FURTHER = (
    "all of them stretch one way and shrink the other: in the sets each sequence has one orbit",
    "beside the sets orbits return on one of two sides or tend to T1 or T2: every finite"
    " sequence is the code of an orbit from T1 to T1 or T2, and of one from T2",
    "the surfaces S1- and S2+ cross transversally: every finite sequence of even length is the code"
    " of one orbit from T1 to T2, and only one with its crossings in the sets",
)
"""Theorems 3, 4 and 8, which a body may lack that has the first two."""
OF_ENERGIES = "all of this of every energy that differs from h by at most {1!r}"
OF_ONE_J2 = (
    "all of this of every energy that differs from h0 + {0!r} by at most {1!r}, but the starts"
    " are those of one J2_0 = sqrt(2 h0/kappa), which have these energies"
)


def compute(config: Config, means: Means) -> Tree:
    """Find the sets and the polynomials of their orbits, and check what they prove."""
    from rigidpend.orbits.return_map import MapError
    from rigidpend.routes.certified import search
    from rigidpend.routes.certified.checker import Undecided

    doubts = []
    try:
        for setting in search.trials(_found(config), config.problem.half_turns):
            means.report(
                f"four sets are found, with passages of {setting.half_turns} half rotations"
            )
            try:
                return _proven(config, setting, means)
            except (MapError, ArithmeticError, Undecided) as doubt:
                doubts.append(f"with {setting.half_turns} half rotations: {doubt}")
    except (MapError, ArithmeticError) as doubt:
        doubts.append(str(doubt))
    raise ArithmeticError(f"{UNDECIDED}: {'; '.join(doubts)}")


def _proven(config: Config, setting: ShiftProblem, means: Means) -> Tree:
    from rigidpend.routes.certified import horseshoe, pieces

    if config.problem.h0 is not None:
        setting = horseshoe.widened(setting, _fraction(config))
    sets = horseshoe.quads(setting)
    orbits = [horseshoe.pieces(setting, quad) for quad in sets]
    starts, theta2 = horseshoe.line(setting, _fraction(config), sets)
    orbits.append(horseshoe.line_pieces(setting, starts, theta2))
    quads, proof = pieces.packed_quads(sets), pieces.packed(orbits)
    energies = None
    if setting.spread:
        energies = pieces.packed_energies(setting.shift, setting.spread, sets, starts)
    line = {name: float(getattr(starts, name)) for name in ("e1", "e2", "centre", "half", "wide")}
    proven = checked(config, quads, line, proof, energies)
    means.report("every code occurs: 8 of 8 covering relations are proven, and those of a line")
    rows = [
        {name: [getattr(one, name) for one in pair] for name in RELATIONS}
        for pair in proven.relations
    ]
    return {
        "sets": datasets(QUADS, quads | _of_sets(proven.arrivals)),
        "relations": datasets(
            RELATIONS, {name: np.array([row[name] for row in rows]) for name in RELATIONS}
        ),
        "line": datasets(LINE, line | _of_line(proven, theta2)),
        "proof": datasets(PROOF, proof),
        **({"energies": datasets(ENERGIES, energies)} if energies else {}),
        "drawn": datasets(DRAWN, _drawn(sets, proven)),
    }


class Proven(NamedTuple):
    """Arrivals and relations that the proof of a result proves."""

    arrivals: list[Reached]
    relations: list[list[Relation]]
    start: Reached
    crossed: list[Relation]
    doubts: tuple[str, str, str]
    """Reasons for which Theorems 3, 4 and 8 are undecided; empty where they are proven."""


def checked(
    config: Config, quads: Data, line: Data, proof: Data, energies: Data | None = None
) -> Proven:
    """Check the proof of a result without integration: what it proves.

    Parameters
    ----------
    config : Config
    quads, line, proof, energies : Data
        The groups `sets`, `line`, `proof` and `energies` of a result, which may lack the last.

    Raises
    ------
    Undecided
        Something is not shown; the text says what.
    """
    from rigidpend.routes.certified import connections, coverings, pieces

    sets = pieces.unpacked_quads(quads, energies)
    numbers = _numbers(config, *pieces.unpacked_energies(energies))
    orbits = pieces.unpacked(proof, len(sets) + 1)
    starts = pieces.unpacked_line(_fraction(config), line, energies)
    arrivals, relations = coverings.prove(numbers, sets, orbits[:-1])
    start, crossed = coverings.prove_line(numbers, starts, orbits[-1], sets, arrivals)
    both = [*itertools.chain(*relations), *crossed]
    cones = _doubt(coverings.prove_cones, both)
    middle = _doubt(connections.prove_connections, numbers, sets, arrivals)
    of_line = starts, orbits[-1], start
    crossing = _doubt(connections.prove_transversal, numbers, of_line, sets, arrivals)
    doubts = cones, middle, cones or middle or crossing
    return Proven(arrivals, relations, start, crossed, doubts)


def _doubt(check: Callable[..., Any], *of: Any) -> str:
    """The reason for which a further theorem is undecided; empty where it is proven."""
    from rigidpend.routes.certified.checker import Undecided

    try:
        check(*of)
    except Undecided as doubt:
        return str(doubt)
    return ""


def theorems(config: Config, data: Data) -> list[str]:
    """Sentences that the proof in a result proves, checked again without integration."""
    from rigidpend.routes.certified.checker import Undecided

    try:
        proven = checked(config, data["sets"], data["line"], data["proof"], data.get("energies"))
    except Undecided as doubt:
        raise ArithmeticError(f"{UNDECIDED}: {doubt}") from None
    count, energies = sum(map(len, proven.relations)), data.get("energies")
    also = OF_ONE_J2 if config.problem.h is None else OF_ENERGIES
    return [
        f"{count} covering relations hold: every sequence of 0 and 1 is the code of an orbit",
        "the line of starts crosses both upward sets: every one-sided sequence is a start's code",
        *(
            f"undecided: {doubt}" if doubt else sentence
            for doubt, sentence in zip(proven.doubts, FURTHER, strict=True)
        ),
        *([also.format(*map(float, (energies["shift"], energies["spread"])))] if energies else []),
    ]


def _found(config: Config) -> ShiftProblem:
    """The body and its energy, or that of the middle of a line of starts of one J2_0."""
    from rigidpend.routes.certified import horseshoe

    problem = config.problem
    if problem.h is not None:
        return horseshoe.ShiftProblem(problem.body, problem.h, 1, spread=_spread(config))
    assert problem.h0 is not None
    return horseshoe.of_one_J2(problem.body, problem.h0, _fraction(config))


def _spread(config: Config) -> Fraction:
    """Half of the width of the energies that a config asks for, rounded upward."""
    wide = float(exact(config.problem.h or 0) * config.problem.around)
    return Fraction(math.nextafter(wide, math.inf) if wide else 0)


def _numbers(config: Config, shift: Fraction, spread: Fraction) -> Numbers:
    """The body and the energies of which a proof is."""
    from rigidpend.routes.certified.checker import Undecided
    from rigidpend.routes.certified.coverings import Numbers

    problem = config.problem
    if problem.h is not None:
        if shift or spread < _spread(config):
            raise Undecided("the energies are not those of the config")
        return Numbers.of(problem.body, problem.h, spread)
    assert problem.h0 is not None
    if not spread:
        raise Undecided("starts of one J2_0 have more energies than one")
    return Numbers.of(problem.body, problem.h0 + exact(shift), spread, problem.h0)


def _fraction(config: Config) -> Fraction:
    """J1_0, which the schema holds to be rational."""
    found = config.problem.J1_0.fraction
    assert found is not None
    return found


def _of_line(proven: Proven, theta2: tuple[float, float]) -> dict[str, Any]:
    names = ("target", "edge", "across", "stretch", "squeeze")
    return {
        "theta2": np.array(theta2),
        "bound": proven.start.bound,
        **{name: np.array([getattr(one, name) for one in proven.crossed]) for name in names},
    }


def _of_sets(found: Sequence[Reached]) -> dict[str, Any]:
    return {
        "symbol": np.array([int(each.right) for each in found]),
        "bound": np.array([each.bound for each in found]),
        "late": np.array([each.late for each in found]),
        "shortest": np.array([each.duration[0] for each in found]),
        "longest": np.array([each.duration[1] for each in found]),
    }


def _drawn(sets: Sequence[Quad], proven: Proven) -> dict[str, Array]:
    """Outlines of the sets and of their images, as the polynomials have them."""
    from rigidpend.routes.certified.coverings import place

    side, one = np.linspace(-1, 1, SIDE), np.ones(SIDE)
    u, v = np.concatenate((side, one, -side, -one)), np.concatenate((-one, side, one, -side))
    rows: dict[str, list[Array]] = {name: [] for name in ("chi", "d", "image_chi", "image_d")}
    for quad, found in zip(sets, proven.arrivals, strict=True):
        for rising, prefix, where in (
            (quad.rising, "", place(quad)),
            (not quad.rising, "image_", (found.d, found.g)),
        ):
            chi, d = _in_chart(sets, rising, where, u, v)
            rows[f"{prefix}chi"].append(chi)
            rows[f"{prefix}d"].append(d)
    line_chi, line_d = _in_chart(sets, True, (proven.start.d, proven.start.g), side, 0 * side)
    outlines = {name: np.array(each) for name, each in rows.items()}
    return {**outlines, "line_chi": line_chi, "line_d": line_d}


def _in_chart(
    sets: Sequence[Quad], rising: bool, where: tuple[Family, Family], u: Array, v: Array
) -> tuple[Array, Array]:
    """chi, and d less that of the stable surface, of points of a section."""
    d, g = (_values(each, u, v) for each in where)
    # The sets of a section lie on either side of its stable surface, equally far.
    curves = [np.array(quad.p, dtype=float) for quad in sets if quad.rising == rising]
    return -np.arcsin(g), d - np.polynomial.polynomial.polyval(g, np.mean(curves, axis=0))


def _values(family: Family, u: Array, v: Array) -> Array:
    """At the energy in the middle."""
    terms = family.doubled.to_dict().items()
    unit = 2.0 ** -(family.bits + 1)
    middle = ((c, at) for at, c in terms if not at[3])
    return np.asarray(sum(int(c) * unit * u ** int(k) * v ** int(l) for c, (_, k, l, _) in middle))


def cost(config: Config) -> float:
    """Estimate of the seconds that a proof takes."""
    return SECONDS
