"""Experiment `full_shift`: four sets that cover each other, and the proof that they do."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Data, Tree
from rigidpend.experiments.full_shift import RELATIONS
from rigidpend.experiments.full_shift.proof import Proven, checked, spread_of
from rigidpend.experiments.full_shift.schema import Config
from rigidpend.experiments.shared import attributes, rational
from rigidpend.machine.workers import note
from rigidpend.numbers import Array
from rigidpend.routes.certified import proof_data, sections
from rigidpend.routes.certified.balls import alone
from rigidpend.routes.certified.models import Family
from rigidpend.routes.certified.proof_data import FamilyStep, Quad

# What finds a proof is imported where one is sought: a proof is checked without it.
if TYPE_CHECKING:
    from rigidpend.routes.certified.chains import Link, OrbitCrossings
    from rigidpend.routes.certified.horseshoe import ShiftProblem

SIDE = 24
"""Points on each side of a drawn outline."""
SECONDS, DEEPER, LONGER = 1.0, 0.1, 2.8
"""Seconds that a proof takes, and those for nu^2; the factor for each further length.

Measured on one core with eight bodies, and with one to three lengths."""
SHOWN = 1e-4
"""Largest relative difference of a stored margin from the proven one: it changes by rounding."""
FURTHER = (
    "all of them stretch one way and shrink the other: each sequence of sets has one orbit in them",
    "beside the sets orbits return on one of two sides or tend to T1 or T2: every finite"
    " sequence is the code of an orbit from T1 to T1 or T2, and of one from T2",
    "the surfaces S1- and S2+ cross transversally: every finite sequence of sets of even length"
    " is that of one orbit from T1 to T2, and of only one",
)
"""Sentences of Theorems 3, 4 and 8, which may be undecided where Theorems 1 and 2 are proven."""
OF_ENERGIES = "all of this holds for every energy that differs from h by at most {1!r}"
OF_ONE_J2 = (
    "all of this holds for every energy that differs from h0 + {0!r} by at most {1!r}, but the"
    " starts are those of one J2_0 = sqrt(2 h0/kappa), which have these energies"
)


@alone
def compute(config: Config, means: Means) -> Tree:
    """Find sets and polynomials of their orbits, check them, and return them with what they prove.

    ArithmeticError where no setting proves a full shift; the text says why, for each.
    """
    from rigidpend.orbits.return_map import MapError
    from rigidpend.routes.certified import horseshoe

    # Every setting may fail for a reason of its own, told at once and with all others in the end.
    doubts = []
    try:
        approach = _approach(config)
        for setting in horseshoe.trials(_problem(config, approach), config.problem.half_turns):
            means.report(f"sets are found, with passages of {setting.described}")
            try:
                return _proven(config, setting, approach, means)
            except (MapError, ArithmeticError) as doubt:
                doubts.append(f"with {setting.described}: {doubt}")
                means.report(f"undecided {doubts[-1]}")
    except (MapError, ArithmeticError) as doubt:
        doubts.append(str(doubt))
    raise ArithmeticError(f"undecided, nothing is proven: {'; '.join(doubts)}")


def _approach(config: Config) -> OrbitCrossings | None:
    """The orbit along which starts come to the sets; None if a config asks for none."""
    from rigidpend.routes.certified.chains import OrbitCrossings
    from rigidpend.routes.symbolic import NoOrbit, find_orbit

    problem = config.problem
    if problem.approach is None:
        return None
    assert problem.h0 is not None
    try:
        found = find_orbit(problem.body, problem.approach, h0=problem.h0, J1_0=problem.J1_0)
    except NoOrbit as reason:
        raise ArithmeticError(f"there is no approach: {reason}") from None
    return OrbitCrossings(float(found.theta2_0), found.d, found.chi)


def _problem(config: Config, approach: OrbitCrossings | None) -> ShiftProblem:
    """The problem of a config, at its energy or at that of a line's middle, for starts of one J2_0.

    Half rotations and bits are left open.
    """
    from rigidpend.routes.certified import horseshoe, start_lines

    problem = config.problem
    if problem.h is not None:
        spread = spread_of(problem.h, problem.around)
        found = horseshoe.ShiftProblem(problem.body, problem.h, 1, spread=spread)
    elif problem.h0 is not None and approach is not None:
        of = problem.body, problem.h0, rational(config.problem.J1_0)
        found = start_lines.of_start(*of, approach.theta2)
    else:
        assert problem.h0 is not None
        found = start_lines.of_one_J2(problem.body, problem.h0, rational(config.problem.J1_0))
    return found._replace(lengths=problem.lengths)


def _proven(
    config: Config, setting: ShiftProblem, approach: OrbitCrossings | None, means: Means
) -> Tree:
    """The result of one setting; Undecided, MapError or ArithmeticError where nothing is proven."""
    from rigidpend.routes.certified import chains, family_orbits, horseshoe, start_lines

    J1 = rational(config.problem.J1_0)
    # The sets have to be proven at all energies of the line of starts, so the line comes first.
    if approach is not None:
        links = chains.links(setting, J1, approach, horseshoe.quads(setting))
        setting = setting._replace(spread=links[0].setting.spread)
    elif config.problem.h0 is not None:
        setting = start_lines.widened(setting, J1)
    sets = horseshoe.quads(setting)
    orbits = []
    for k, quad in enumerate(sets):
        note(partial("polynomials of set {} of 0 to {} are found".format, k, len(sets) - 1))
        orbits.append(family_orbits.pieces(setting, quad))
    if approach is not None:
        return _stored(config, sets, orbits + chains.linked([*links, None]), links, means)
    starts, ends = start_lines.line(setting, J1, sets)
    link = chains.Link(starts, start_lines.with_bits(setting, J1, ends, sets), theta2=ends)
    link, begun = chains.across(link, sets)
    return _stored(config, sets, [*orbits, begun], [link], means)


def _stored(
    config: Config,
    sets: Sequence[Quad],
    orbits: Sequence[Sequence[FamilyStep]],
    links: Sequence[Link],
    means: Means,
) -> Tree:
    """The result with its margins, if the proof holds; Undecided if it does not."""
    data = _offered(sets, orbits, links)
    # What is stored is checked, in the form in which a reader gets it.
    proven = checked(config, data)
    count = sum(map(len, proven.relations))
    means.report(f"every code occurs: {count} covering relations are proven, and those of a line")
    for name, fields in margins(proven).items():
        data[name] = data.get(name, {}) | fields
    data["line"]["theta2"] = np.array(links[0].theta2)
    return {**data, "drawn": drawn(sets, proven)}


def _offered(
    sets: Sequence[Quad], orbits: Sequence[Sequence[FamilyStep]], links: Sequence[Link]
) -> dict[str, Any]:
    """The parts of a proof: sets, a line of starts, energies, an approach and polynomials."""
    starts: Any = links[0].start
    before: Any = [link.start for link in links[1:]]
    data: dict[str, Any] = {
        "sets": proof_data.packed_quads(sets),
        "line": proof_data.packed_line(starts),
        "proof": proof_data.packed(orbits),
    }
    if (of := links[0].setting).spread:
        data["energies"] = proof_data.packed_energies(of.shift, of.spread, sets, starts)
    if before:
        data["approach"] = proof_data.packed_quads(before)
    return data


def margins(proven: Proven) -> dict[str, dict[str, Any]]:
    """The symbols, bounds and margins that a proof shows, by group."""
    found = proven.arrivals
    shortest, longest = np.transpose([each.duration for each in found])
    of_line = [name for name in RELATIONS if name != "orientation"]
    rows = [attributes(RELATIONS, pair) for pair in proven.relations]
    told = {
        "sets": {
            "symbol": np.array([int(each.right) for each in found]),
            **attributes(("bound", "late"), found),
            "shortest": shortest,
            "longest": longest,
        },
        "line": {"bound": proven.start.bound, **attributes(of_line, proven.crossed)},
        "relations": {name: np.array([row[name] for row in rows]) for name in RELATIONS},
    }
    if proven.symbols:
        told["approach"] = {"symbol": np.array(proven.symbols, dtype=np.int64)}
    return told


def drawn(sets: Sequence[Quad], proven: Proven) -> dict[str, Array]:
    """Outlines of the sets and of their images, and the line's image, by the polynomials."""
    side, one = np.linspace(-1, 1, SIDE), np.ones(SIDE)
    around = np.concatenate((side, one, -side, -one)), np.concatenate((-one, side, one, -side))
    images = [(found.d, found.g) for found in proven.arrivals]
    own = [_in_chart(sets, quad.rising, sections.place(quad), *around) for quad in sets]
    over = [_in_chart(sets, not q.rising, x, *around) for q, x in zip(sets, images, strict=True)]
    start, rising = proven.start, sets[proven.crossed[0].target].rising
    line = _in_chart(sets, rising, (start.d, start.g), side, 0 * side)
    return {
        f"{prefix}{name}": np.array(outlines)
        for prefix, each in (("", zip(*own, strict=True)), ("image_", zip(*over, strict=True)))
        for name, outlines in zip(("chi", "d"), each, strict=True)
    } | {"line_chi": line[0], "line_d": line[1]}


def _in_chart(
    sets: Sequence[Quad], rising: bool, where: tuple[Family, Family], u: Array, v: Array
) -> tuple[Array, Array]:
    """The coordinates chi and d of points of a section, d less that of the stable surface."""
    d, g = (_values(each, u, v) for each in where)
    # The sets of a section lie on either side of its stable surface, equally far: the mean of
    # their curves is near it.
    curves = [np.array(quad.p[0], dtype=float) for quad in sets if quad.rising == rising]
    return -np.arcsin(g), d - np.polynomial.polynomial.polyval(g, np.mean(curves, axis=0))


def _values(family: Family, u: Array, v: Array) -> Array:
    """Values at some u and v of a family that does not depend on x, at the energy w = 0."""
    terms = family.doubled.to_dict().items()
    unit = 2.0 ** -(family.bits + 1)
    middle = ((c, at) for at, c in terms if not at[3])
    return np.asarray(sum(int(c) * unit * u ** int(k) * v ** int(l) for c, (_, k, l, _) in middle))


def theorems(config: Config, data: Data) -> list[str]:
    """Sentences that the proof in a result proves; it is checked again without integration."""
    proven = checked(config, data)
    # Nothing is proven by these, but tables show them.
    for group, fields in margins(proven).items():
        for name, found in fields.items():
            if not np.allclose(data[group][name], found, rtol=SHOWN, atol=0):
                raise ArithmeticError(f"{group}/{name} is not what the proof shows")
    first, last = data["line"]["theta2"]
    if not proven.theta2[0] <= first <= last <= proven.theta2[1]:
        raise ArithmeticError("line/theta2 is not within the phases of the proof")
    count, energies = sum(map(len, proven.relations)), data.get("energies")
    also = OF_ONE_J2 if config.problem.h is None else OF_ENERGIES
    return [
        f"{count} covering relations hold: every sequence of 0 and 1 is the code of an orbit",
        _of_starts(proven),
        *(
            f"undecided: {doubt}" if doubt else sentence
            for doubt, sentence in zip(proven.doubts, FURTHER, strict=True)
        ),
        *([also.format(*map(float, (energies["shift"], energies["spread"])))] if energies else []),
    ]


def _of_starts(proven: Proven) -> str:
    """The sentence on the codes of a line of starts."""
    word, starts = "".join(map(str, proven.symbols)), sections.words_on_phases(*proven.theta2)
    after, behind = (f" after the symbols {word}", " behind these") if word else ("", "")
    every = f"every one-sided sequence is a start's code{behind}"
    return f"a line of starts with {starts} crosses the sets{after}: {every}"


def cost(config: Config) -> float:
    """Estimate of the seconds that a config takes, where the first sets prove a full shift."""
    problem = config.problem
    return (SECONDS + DEEPER * problem.body.nu**2) * LONGER ** (problem.lengths - 1)
