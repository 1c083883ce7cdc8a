"""Check the proof that an orbit with a given code exists, without a line of the package.

    .venv/bin/python -m scripts.check_orbit FILE [--config FIG4.yaml] [-j PROCESSES]

It follows Theorem 7 of docs/full-shift.md with the parts of scripts/check_full_shift.py for C1
to C6: a line of starts crosses the first set, each set covers the next, and the passages have the
symbols of the code.
"""

import json
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from fractions import Fraction
from pathlib import Path
from typing import Any

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
from scripts.check_coverings import prove_link
from scripts.check_proof_data import (
    ENERGIES,
    LINE,
    PROOF,
    QUAD,
    doubles,
    quads_of,
    steps_of_sets,
    whole,
)
from scripts.check_sections import Line, phases, problem_of, words_on_phases
from scripts.check_series import DIGITS

SETS = 10_000
"""Sets along an orbit at most."""
GIVEN = ("A", "r", "mu", "h0", "J1_0")
"""What a config of Fig. 4's kind says of the starts."""


def checked(problem: dict[str, Any], pair: Sequence[tuple[Any, dict[str, Any]]]) -> int:
    """The symbol of one set, or of the line, with the next, as they are stored."""
    Interval.digits = DIGITS
    link, after = ((source, steps_of_sets(proof, 1)[0] if proof else []) for source, proof in pair)
    return prove_link(problem_of(problem), link, after)


# ---- The file.


def exactly(x: Any) -> Fraction:
    return Fraction(float(x))


def read(path: Path) -> tuple[dict[str, Any], list[Any], dict[str, Any], dict[str, Fraction]]:
    """The config of a proof, its line and sets, the arrays of its steps, and its energies."""
    import h5py

    try:
        with h5py.File(path) as file:
            bounded(file, path.stat().st_size)
            config = json.loads(file["config"].asstr()[()])
            data = file["data"]
            sets, starts = doubles(data["sets"], QUAD), doubles(data["line"], LINE)
            proof = whole(data["proof"], PROOF)
            energies = {k: exactly(x) for k, x in doubles(data["energies"], ENERGIES[:2]).items()}
        if len(sets["rising"]) > SETS or sets["p"].shape[1:] != (2,):
            raise Refused(f"there are more than {SETS} sets, or their curves are no lines")
        quads = list(quads_of(sets, [[]] * len(sets["p"])))
        if not all(quad.a and quad.b and quad.l1 for quad in quads):
            raise Refused("a set has no extent")
        e1, e2, centre, half = (exactly(starts[k]) for k in LINE)
        line = Line(number(config["problem"]["J1_0"]), e1, e2, centre, half)
        return config, [line, *quads], proof, energies
    except (OSError, KeyError, ValueError, TypeError, AttributeError, IndexError, OverflowError,
            RuntimeError) as error:  # fmt: skip
        raise Refused(f"it cannot be read: {str(error)[:200]}") from None


def each(proof: dict[str, Any], which: Sequence[int], n: int) -> Iterator[dict[str, Any]]:
    """The arrays of the steps of some of n sets, one after the other: no others have any."""
    of, terms = ([int(x) for x in proof[name]] for name in ("family", "terms"))
    if (
        not len(of) == len(terms) == len(proof["bits"])
        or any(x < 1 for x in terms)
        or not sum(terms) == len(proof["powers"]) == len(proof["coefficients"])
    ):
        raise Refused("steps are not as many as they say")
    first, row = 0, 0
    for k in which:
        last, end = first, row
        while last < len(of) and of[last] in (k, k + n):
            last, end = last + 1, end + terms[last]
        if last == first:
            raise Refused(f"set {k - 1} has no steps, or they are out of order")
        # As if of the first of one set, of which one more is what is finer.
        here = {name: proof[name][first:last] for name in ("bits", "terms")}
        rows = {name: proof[name][row:end] for name in ("powers", "coefficients")}
        family = [0 if x == k else 1 for x in of[first:last]]
        yield {"family": family, **here, **rows}
        first, row = last, end
    if first < len(of):
        raise Refused("there are steps of no set, or they are out of order")


def check(path: Path, given: Path | None = None, processes: int = 1) -> str:
    """What a file proves, and of which numbers; raises Refused or Fails."""
    Interval.digits = DIGITS
    config, sources, proof, energies = read(path)
    code, problem = config.get("code"), dict(config.get("problem") or {})
    if not isinstance(code, str) or set(code) - {"0", "1"} or len(code) + 1 != len(sources):
        raise Refused("its code is none, or not of as many symbols as there are sets")
    try:
        if given:
            wanted = stated_by(given)["problem"]
            check_against({k: problem[k] for k in GIVEN}, {k: wanted[k] for k in GIVEN})
        problem = {k: problem[k] for k in GIVEN}
        of = "A = {}; r = {}; mu = {}; h0 = {}; J1_0 = {}".format(
            *(", ".join(problem[key]) for key in ("A", "r")), *(problem[k] for k in GIVEN[2:])
        )
        problem |= energies
    except (KeyError, TypeError, AttributeError) as error:
        raise Refused(f"its config, or the one given, lacks something: {error!r}") from None
    Interval.digits = DIGITS
    if Interval.of(sources[0].J1).low <= 0 or energies["spread"] <= 0:
        raise Refused("J1_0 > 0 is broken, or cannot be told; or there are no energies")
    links: list[Any] = [
        *zip(sources, each(proof, range(len(sources)), len(sources)), strict=True),
        (None, {}),
    ]
    pairs = [links[k : k + 2] for k in range(len(sources))]
    with ProcessPoolExecutor(processes) as pool:
        for k, symbol in enumerate(pool.map(checked, [problem] * len(pairs), pairs)):
            # What follows on the line has no symbol.
            if k and str(symbol) != code[k - 1]:
                raise Fails(f"symbol {k} is {symbol}")
    where = phases(problem_of(problem), sources[0], steps_of_sets(links[0][1], 1)[0][0])
    return f"proven of {of}: of the starts with theta2_0 {words_on_phases(where)} one has {code}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Check a proof; the exit code is 0 where it holds."""
    return answered(arguments, __doc__, lambda *given: [check(*given)])


if __name__ == "__main__":
    sys.exit(main())
