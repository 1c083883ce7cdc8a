"""Check of a stored full shift, without integration: its sets, line of starts and theorems."""

import itertools
import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

from rigidpend.experiments.data import Data
from rigidpend.experiments.full_shift.schema import Config
from rigidpend.experiments.shared import rational
from rigidpend.numbers.exact import Exact, exact
from rigidpend.routes.certified import connections, coverings, proof_data, sections
from rigidpend.routes.certified.coverings import Relation
from rigidpend.routes.certified.passages import Reached
from rigidpend.routes.certified.proof_data import Followed, Undecided


class Proven(NamedTuple):
    """Crossings and relations that a result proves, and theorems that stay undecided."""

    arrivals: list[Reached]
    """The next crossings of each set."""
    relations: list[list[Relation]]
    """The relations of each set."""
    start: Reached
    """Crossings of the line of starts, or of the last set of its approach."""
    crossed: list[Relation]
    """The relations of the line, or of the last set of its approach."""
    symbols: list[int]
    """The symbols of the approach."""
    theta2: tuple[float, float]
    """Bounds on theta2_0 of the starts, radians."""
    doubts: tuple[str, str, str]
    """Reasons for which Theorems 3, 4 and 8 are undecided; empty texts where they are proven."""


def checked(config: Config, data: Data) -> Proven:
    """Check the proof of a result without integration, and return what it proves.

    Of its data the groups `sets`, `line`, `proof` and, if there are, `energies` and `approach` are
    used, no margins. Undecided where Theorems 1 and 2 are not shown; the text says why.
    """
    energies, approach = data.get("energies"), data.get("approach")
    sets = proof_data.unpacked_quads(data["sets"], energies)
    before = proof_data.unpacked_quads(approach) if approach else []
    numbers = _numbers(config, *proof_data.unpacked_energies(energies))
    orbits = proof_data.unpacked(data["proof"], len(sets) + 1 + len(before))
    starts = proof_data.unpacked_line(rational(config.problem.J1_0), data["line"], energies)
    arrivals, relations = coverings.prove(numbers, sets, orbits[: len(sets)])
    links: list[Followed] = list(zip([starts, *before], orbits[len(sets) :], strict=True))
    start, crossed, symbols = coverings.prove_line(numbers, links, sets, arrivals)
    if tuple(symbols) != _asked(config):
        raise Undecided("the symbols of the approach differ from those that its config asks for")
    # Theorems 1 and 2 are proven here: a doubt on a further one is noted, and does not end the
    # check. With an approach nothing is claimed of how many starts have a code: no C7 of the line.
    cones = [*itertools.chain(*relations), *([] if before else crossed)]
    remedy = "a smaller around" if float(config.problem.around) else "a larger mu/h"
    cone = _doubt(coverings.prove_cones, cones, remedy)
    middle = _doubt(connections.prove_connections, numbers, sets, arrivals)
    crossing = "C9: the starts come to the sets by an approach"
    if not before:
        of_line = starts, links[0][1], start
        crossing = _doubt(connections.prove_transversal, numbers, of_line, sets, arrivals)
    theta2 = sections.phases(numbers, starts, links[0][1])
    # Theorem 8 needs C7 and C8 as well.
    doubts = cone, middle, cone or middle or crossing
    return Proven(arrivals, relations, start, crossed, list(map(int, symbols)), theta2, doubts)


def _doubt(check: Callable[..., Any], *of: Any) -> str:
    """The reason for which a further theorem is undecided; empty where it is proven."""
    try:
        check(*of)
    except Undecided as doubt:
        return str(doubt)
    return ""


def _asked(config: Config) -> tuple[int, ...]:
    """The symbols of the approach that a config asks for."""
    from rigidpend.routes.symbolic.address import parsed

    asked = config.problem.approach
    return () if asked is None else parsed(asked).symbols


def _numbers(config: Config, shift: Fraction, spread: Fraction) -> sections.Numbers:
    """The numbers of the body and of a proof's energies; Undecided if not the config's."""
    problem = config.problem
    # Of one h the interval may be wider than asked for, but not elsewhere; of one h0 it may be any,
    # since the checker proves that those of the line's starts are among them (C6).
    if problem.h is not None:
        if shift or spread < spread_of(problem.h, problem.around):
            raise Undecided("the energies are not those of the config")
        return sections.Numbers.of(problem.body, problem.h, spread)
    assert problem.h0 is not None
    if not spread:
        raise Undecided("starts of one J2_0 have more energies than one")
    return sections.Numbers.of(problem.body, problem.h0 + exact(shift), spread, problem.h0)


def spread_of(h: Exact, around: Exact) -> Fraction:
    """Half of the width of the energies around h that a config asks for, rounded upward."""
    wide = float(h * around)
    return Fraction(math.nextafter(wide, math.inf) if wide else 0)
