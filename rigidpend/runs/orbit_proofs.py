"""Proofs that an orbit with a given code exists, as files: made, and checked again.

`docs/full-shift.md` has the theorem. A file says body, energy, J1_0 and code, and holds a line of
starts, sets along the orbit, and the polynomials that prove that each covers the next.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from rigidpend import experiments
from rigidpend.experiments.data.layout import WHOLE, Field, datasets
from rigidpend.experiments.full_shift.layout import LINE, PROOF, QUADS
from rigidpend.machine.words import short
from rigidpend.results import store
from rigidpend.routes.certified.checker import Undecided
from rigidpend.routes.certified.progress import Report
from rigidpend.runs import certificate_files, provenance
from rigidpend.runs.loading import LoadedConfig

if TYPE_CHECKING:
    from rigidpend.mechanics.body import Body
    from rigidpend.numbers.exact import Exact
    from rigidpend.routes.certified.chains import Link
    from rigidpend.routes.certified.pieces import Quad, StartLine
    from rigidpend.routes.symbolic import FoundOrbit

SUFFIX = f".orbit{certificate_files.SUFFIX}"
"""Ending of the name of such a file."""
AT_ONCE = 16
"""Sets that a process takes at a time, some seconds, and overlaps with the next by one."""
ROUND = 4
"""Times that each process is asked before a line of progress."""
PROBLEM = ("A", "r", "mu", "h", "J1_0")
"""What is proven is of these."""
LAYOUT = {
    "sets": {name: QUADS[name] for name in ("rising", "a", "b", "l0", "l1", "p")},
    "line": {name: LINE[name] for name in ("e1", "e2", "centre", "half")},
    "proof": {**PROOF, "family": Field(WHOLE, ("steps",), "1", "0: the line; k: the k-th set")},
}


def prove(
    config: LoadedConfig, found: FoundOrbit, file: Path, *, jobs: int, report: Report
) -> None:
    """Prove that an orbit beside one that was found has its code, and write the proof.

    Its energy is that of the orbit found, J1_0 the config's; J2_0 follows from them.

    Raises
    ------
    Undecided, StoreError, ConfigError
    """
    from rigidpend.machine.workers import side_by_side
    from rigidpend.routes.certified import chains, horseshoe, pieces
    from rigidpend.routes.problem import RouteProblem
    from rigidpend.routes.symbolic.surface import surface

    if not is_proof(file):
        raise store.StoreError(f"{file}: a proof is named X{SUFFIX}")
    store.prepare(file)
    given: Any = config.content
    given = given.problem
    theta2, n = float(found.theta2_0), len(found.symbols)
    at = surface(RouteProblem(given.body, given.h0, given.J1_0, n))
    # Sixteen digits, which stand for themselves exactly.
    stated = {key: config.resolved()["problem"][key] for key in ("A", "r", "mu", "J1_0")}
    stated = stated | {"h": repr(at.energy(theta2))}
    problem = _problem(file, stated)
    setting = horseshoe.ShiftProblem(problem.body, problem.h, 1)
    links = chains.links(setting, _J1(problem), chains.Crossings(theta2, found.d, found.chi))
    arrays: list[Any] = []
    parts = [(links[part.start : part.stop], whole) for part, whole in _parts(len(links))]
    for first in range(0, len(parts), ROUND * jobs):
        some = parts[first : first + ROUND * jobs]
        arrays += side_by_side(_made, (), True, some, jobs)
        report(f"{min(n, AT_ONCE * (first + len(some)))} of {n} passages are proven")
    data = {
        "sets": pieces.packed_quads([link.of for link in links[1:]]),  # type: ignore[misc]
        "line": {name: float(getattr(links[0].of, name)) for name in LAYOUT["line"]},
        "proof": pieces.joined(arrays, [len(part) - (not whole) for part, whole in parts]),
    }
    tree = {name: datasets(fields, data[name]) for name, fields in LAYOUT.items()}
    code = "".join(map(str, found.symbols))
    of = {"experiment": "full_shift", "problem": stated, "code": code}
    store.write(file, store.Result({}, of, provenance.provenance(), tree))
    report(f"{file} written")


def is_proof(file: Path) -> bool:
    """True if the name of a file is that of such a proof."""
    return file.name.endswith(SUFFIX)


def check(file: Path, jobs: int, report: Report) -> str:
    """Check a proof again, without integration: the sentence that it proves.

    Raises
    ------
    StoreError
        It is none, or does not prove what it says.
    """
    from rigidpend.machine.workers import side_by_side
    from rigidpend.routes.certified import coverings, pieces

    stored = store.load(file, LAYOUT, ratio=certificate_files.RATIO)
    stated, data = stored["config"], stored["data"]
    problem, code = _problem(file, stated.get("problem")), str(stated.get("code"))
    try:
        line = pieces.unpacked_line(_J1(problem), data["line"])
        sources = [line, *pieces.unpacked_quads(data["sets"])]
        if len(sources) != len(code) + 1 or set(code) - {"0", "1"}:
            raise ValueError(f"a code of {len(code)} symbols, and {len(sources) - 1} sets")
        parts = []
        for part, whole in _parts(len(sources)):
            proof = pieces.of_some(data["proof"], len(sources), part)
            parts.append((part.start, sources[part.start : part.stop], proof, whole))
        proven: list[bool] = []
        for first in range(0, len(parts), ROUND * jobs):
            some = parts[first : first + ROUND * jobs]
            for found in side_by_side(_checked, (problem.body, problem.h), True, some, jobs):
                proven += found
            report(f"{len(proven) - 1} of {len(code)} passages are proven")
        if (symbols := "".join(str(int(x)) for x in proven[1:])) != code:
            raise Undecided(f"the code is {symbols}")
        numbers = coverings.Numbers.of(problem.body, problem.h)
        [begin] = pieces.unpacked(pieces.of_some(data["proof"], len(sources), range(1)), 1)
        low, high = coverings.phases(numbers, line, begin)
    except (ValueError, Undecided) as error:
        raise store.StoreError(f"{file}: not proven: {short(error)}") from None
    # Rounded outward.
    ends = f"{math.floor(low * 1e9) / 1e9:.9f} to {math.ceil(high * 1e9) / 1e9:.9f}"
    return (
        f"of the starts with J1_0 = {problem.J1_0}, the energy {problem.h} and theta2_0 from"
        f" {ends} one has these {len(code)} symbols: {code}"
    )


def _parts(n: int) -> list[tuple[range, bool]]:
    """Parts of n sources, which overlap by one; with True for the last one."""
    starts = range(0, n, AT_ONCE)
    return [(range(k, min(k + AT_ONCE + 1, n)), k + AT_ONCE >= n) for k in starts]


def _made(part: tuple[Sequence[Link], bool]) -> dict[str, Any]:
    from rigidpend.routes.certified import chains, pieces

    return pieces.packed(chains.linked(*part))


def _checked(
    part: tuple[int, Sequence[Quad | StartLine], Mapping[str, Any], bool], body: Body, h: Exact
) -> list[bool]:
    """The symbols of a part; its last set, unless it is the last of all, is only covered."""
    from rigidpend.routes.certified import coverings, pieces

    first, sources, proof, whole = part
    numbers, found = coverings.Numbers.of(body, h), []
    links = list(zip(sources, pieces.unpacked(proof, len(sources)), strict=True))
    for k, (link, after) in enumerate(pairwise([*links, None] if whole else links)):
        try:
            found.append(coverings.prove_link(numbers, link, after))
        except Undecided as doubt:
            name = f"set {first + k}" if first + k else "line of starts"
            raise Undecided(f"{name}: {doubt}") from None
    return found


def _problem(file: Path, stated: Any) -> Any:
    """Body, energy and action, checked by the schema of a full shift."""
    try:
        text = {key: stated[key] for key in PROBLEM}
        return (
            experiments.schema("full_shift")
            .model_validate({"experiment": "full_shift", "figure": "", "problem": text})
            .problem
        )  # type: ignore[attr-defined]
    except ValidationError as error:
        raise store.StoreError(f"{file}: {short(error.errors()[0]['msg'])}") from None
    except (KeyError, TypeError) as error:
        raise store.StoreError(f"{file}: its config lacks {short(error)}") from None


def _J1(problem: Any) -> Fraction:
    found = problem.J1_0.fraction
    assert found is not None
    return Fraction(found)
