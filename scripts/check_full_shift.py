"""Check the proof of a full shift once more, without a line of the package.

    .venv/bin/python -m scripts.check_full_shift FILE [--config FULL_SHIFT.yaml]

It follows docs/full-shift.md from the definitions to C9, in Python's integers and fractions, with
the intervals of scripts/check_certificate.py. The exit code is 0 only if all covering relations of
the sets, and those of the line of starts and of its approach, are proven of the config's body. The
printed line also says if it is proven that each sequence has one orbit (C7), what orbits do beside
the sets (C8), and how the surfaces of the periodic orbits cross (C9).

Parts
-----
check_series       polynomials with an error
check_sections     the body's constants; sets and lines, and the orbits that begin there (C1)
check_passages     these orbits up to their next crossing (C2 to C5)
check_connections  orbits beside the sets, and how surfaces cross (C8, C9)
check_coverings    the relations of sets (C6, C7), and the proof from all of these
check_proof_data   sets and steps as files hold them
"""

import json
import math
import re
import sys
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

from scripts.check_certificate import (
    Fails,
    Interval,
    Refused,
    answered,
    bounded,
    check_against,
    number,
    stated_by,
)
from scripts.check_coverings import Proven, prove
from scripts.check_proof_data import (
    ENERGIES,
    LINE,
    MOST,
    PROOF,
    QUAD,
    doubles,
    quads_of,
    steps_of_sets,
    whole,
)
from scripts.check_sections import Line, Quad, Step, words_on_phases
from scripts.check_series import DIGITS, below

FURTHER = (
    "each sequence of sets has one orbit in them",
    "every finite one has an orbit from T1 or T2 to T1 or T2",
    "S1- and S2+ cross transversally, in one orbit for each one of even length",
)
"""Words on Theorems 3, 4 and 8, which may be undecided where Theorems 1 and 2 are proven."""


class Read(NamedTuple):
    """The content of a file."""

    config: dict[str, Any]
    quads: list[Quad]
    approach: list[Quad]
    line: list[Any]
    """All of a Line but J1."""
    orbits: list[list[Step]]
    shift: Fraction
    spread: Fraction


def read(path: Path) -> Read:
    """The config of a result, its sets and energies, the numbers of its line, and all steps."""
    import h5py

    try:
        with h5py.File(path) as file:
            bounded(file, path.stat().st_size)
            config = json.loads(file["config"].asstr()[()])
            data = file["data"]
            sets, proof = doubles(data["sets"], QUAD), whole(data["proof"], PROOF)
            wide = ("wide",) if "wide" in data["line"] else ()
            starts = doubles(data["line"], (*LINE, *wide))
            several = doubles(data["energies"], ENERGIES) if "energies" in data else {}
            before = doubles(data["approach"], QUAD) if "approach" in data else {}
        moves = several.get("moves", [[]] * len(sets["a"]))
        shift, spread = (Fraction(float(several.get(k, 0))) for k in ("shift", "spread"))
        if len(moves[0]) > MOST["curve"] or spread < 0:
            raise Refused(
                f"sets move by more than {MOST['curve']} powers of w, or by less than none"
            )
        quads = list(quads_of(sets, moves))
        approach = list(quads_of(before, [[]] * len(before["a"]))) if before else []
        line = [Fraction(float(starts[name])) for name in LINE]
        aside = Fraction(float(starts.get("wide", 0)))
        line_moves = [Fraction(float(x)) for x in several.get("line", [])]
        orbits = steps_of_sets(proof, len(quads) + 1 + len(approach))
        return Read(config, quads, approach, [*line, line_moves, aside], orbits, shift, spread)
    except (OSError, KeyError, ValueError, TypeError, AttributeError, IndexError, OverflowError,
            RuntimeError) as error:  # fmt: skip
        raise Refused(f"it cannot be read: {str(error)[:200]}") from None


def _stated(config: dict[str, Any]) -> dict[str, Any]:
    """The part of a config that a proof is about: not how many half rotations were asked for."""
    given = {"around": "0"} | dict(config["problem"].items())
    left_out = (None, "null")
    searched = ("half_turns", "lengths")
    problem = {name: x for name, x in given.items() if name not in searched and x not in left_out}
    return {"experiment": config["experiment"], "problem": problem}


def word_of(address: str) -> str:
    """The symbols of an address such as a 0^8 1^9 (1^15)*2."""
    repeated = re.compile(r"\(([01])\^[0-9]+\)\*([0-9]{1,3})(?![0-9])")
    each = repeated.sub(lambda found: found[1] * int(found[2]), address)
    return re.sub(r"\^[0-9]+|[ab ]", "", each)


def energies_of(found: Read) -> dict[str, Fraction]:
    """The energies of a proof, shift and spread; refused if its config asks for others."""
    given = found.config["problem"]
    if given.get("h") is not None and given.get("h0") is not None:
        raise Refused("its config has both h and h0")
    if given.get("h") is None:
        if not found.spread:
            raise Refused("starts of one J2_0 have other energies than one")
    else:
        wide = Interval.of(number(given.get("around", "0")) * number(given["h"]))
        if wide.low < 0:
            raise Refused("around >= 0 is broken, or cannot be told")
        if found.shift or found.spread < wide.above:
            raise Refused("its config asks for other energies than it is of")
    return {"shift": found.shift, "spread": found.spread}


def check(path: Path, given: Path | None = None) -> str:
    """The sentence that a result proves, with its numbers; raises Refused or Fails."""
    Interval.digits = DIGITS
    found = read(path)
    config = found.config
    try:
        if given:
            check_against(_stated(config), _stated(stated_by(given)))
            Interval.digits = DIGITS
        name = "h" if config["problem"].get("h") is not None else "h0"
        problem = {key: config["problem"][key] for key in ("A", "r", "mu", name)}
        action = config["problem"]["J1_0"]
        triples = [", ".join(problem[key]) for key in ("A", "r")]
        of = f"A = {triples[0]}; r = {triples[1]}; mu = {problem['mu']}; {name} = {problem[name]}"
    except (KeyError, TypeError, IndexError, AttributeError) as error:
        raise Refused(f"its config, or the one given, lacks something: {error!r}") from None
    problem |= energies_of(found)
    if found.spread:
        of += f" + {float(found.shift)!r}" if found.shift else ""
        of += f", energies that differ from it by at most {float(found.spread)!r}"
    J1 = number(action)
    if Interval.of(J1).low <= 0:
        raise Refused("J1_0 > 0 is broken, or cannot be told")
    asked = config["problem"].get("approach")
    proven = prove(problem, found.quads, Line(J1, *found.line), found.orbits, found.approach)
    if proven.word != (word_of(asked) if isinstance(asked, str) else ""):
        raise Fails(
            f"the symbols of the approach are {proven.word}, and its config asks for others"
        )
    return f"proven of {of}: {sentence(found.quads, action, proven)}"


def sentence(quads: Sequence[Quad], action: str, proven: Proven) -> str:
    """Words on a proof, of sets and of starts of a J1_0."""
    # Rounded outward.
    least = math.floor(min(map(below, proven.times)) * 10**4) / 10**4
    most = math.ceil(max(x.above for x in proven.times) * 10**4) / 10**4
    further = (
        f"; undecided: {doubt}" if doubt else f"; {theorem}"
        for doubt, theorem in zip(proven.doubts, FURTHER, strict=True)
    )
    up = sum(quad.rising for quad in quads)
    count = 2 * up * (len(quads) - up)
    behind = f", behind the symbols {proven.word}" if proven.word else ""
    return (
        f"{count} covering relations, so every sequence is the code of an orbit,"
        f" with {least} to {most} t' a passage, and the entropy at least"
        f" ln({count // 2})/2 a passage; and of a line of starts of J1_0 = {action} with"
        f" theta2_0 {words_on_phases(proven.theta2)}{behind}" + "".join(further)
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Check a result; the exit code is 0 where the full shift is proven."""
    return answered(arguments, __doc__, lambda *given: [check(*given)], alone=True)


if __name__ == "__main__":
    sys.exit(main())
