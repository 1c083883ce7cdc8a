"""Proofs that an orbit with a given code exists, as files: made, and checked again.

`docs/full-shift.md` states the theorem (Theorem 7). A file states body, h0, J1_0 and code, and
holds a line of starts, sets along the orbit, and polynomials that prove that each covers the next.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from pydantic import ValidationError

from rigidpend import experiments
from rigidpend.config import validation
from rigidpend.experiments.data import whole
from rigidpend.experiments.full_shift import ENERGIES, LINE, PROOF, QUADS
from rigidpend.machine import files
from rigidpend.machine.wording import counted, short
from rigidpend.machine.workers import side_by_side
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import exact
from rigidpend.results import store
from rigidpend.routes.certified import coverings, proof_data, sections
from rigidpend.routes.certified.codes import Report
from rigidpend.routes.certified.proof_data import Source, Undecided
from rigidpend.runs import certificate_files, provenance
from rigidpend.runs.loading import LoadedConfig

# What finds a proof is imported where one is made: a proof is checked without it.
if TYPE_CHECKING:
    from rigidpend.routes.certified.chains import Link
    from rigidpend.routes.symbolic import FoundOrbit

Result = TypeVar("Result")

SUFFIX = f".orbit{certificate_files.SUFFIX}"
"""Ending of the name of such a file."""
AT_ONCE = 16
"""Links that a process takes at a time, some seconds, besides the one that follows them."""
PROBLEM = ("A", "r", "mu", "h0", "J1_0")
"""Numbers for which a code is proven."""
LAYOUT = {
    "sets": {name: QUADS[name] for name in ("rising", "a", "b", "l0", "l1", "p")},
    "line": {name: LINE[name] for name in ("e1", "e2", "centre", "half")},
    "energies": {name: ENERGIES[name] for name in ("shift", "spread")},
    "proof": {**PROOF, "family": whole("1", "0: the line; k: the k-th set", "steps")},
}


def prepare(file: Path) -> None:
    """Refuse a file to which no proof can be written: ParameterError for its name, StoreError."""
    if not is_proof(file):
        raise ParameterError("proof", f"{file}: the name of a proof ends in {SUFFIX}")
    files.prepare(file, "choose another file with --proof")


def prove(
    config: LoadedConfig, found: FoundOrbit, file: Path, *, jobs: int, report: Report
) -> None:
    """Prove that an orbit beside a found one has its code, and write the proof.

    Undecided where it cannot be proven.
    """
    from rigidpend.routes.certified import chains, start_lines

    stated = {key: config.resolved()["problem"][key] for key in PROBLEM}
    problem, J1 = _problem(file, stated)
    theta2, n = float(found.theta2_0), len(found.symbols)
    # The sets are made at the energy of this start; all starts of the line have energies near it.
    setting = start_lines.of_start(problem.body, problem.h0, J1, theta2)
    links = chains.links(setting, J1, chains.OrbitCrossings(theta2, found.d, found.chi))
    parts = [[*links, None][part.start : part.stop] for part in _parts(len(links))]
    arrays = _side_by_side(_made, (), parts, jobs, n, report)
    sources: list[Any] = [link.start for link in links]
    line = proof_data.packed_line(sources[0])
    data = {
        "sets": proof_data.packed_quads(sources[1:]),
        "line": {name: line[name] for name in LAYOUT["line"]},
        "energies": {"shift": float(setting.shift), "spread": float(links[0].setting.spread)},
        # The last set of each part is made anew as the first one of the next part.
        "proof": proof_data.joined(arrays, [len(part) - 1 for part in parts]),
    }
    code = "".join(map(str, found.symbols))
    of = {"experiment": "full_shift", "problem": stated, "code": code}
    store.write(file, LAYOUT, data, {}, of, provenance.provenance())
    report(f"{file} written")


def is_proof(file: Path) -> bool:
    """True if the name of a file is that of such a proof."""
    return file.name.endswith(SUFFIX)


def check(file: Path, jobs: int, report: Report) -> str:
    """Check a proof again, without integration, and return the sentence that it proves.

    StoreError where the file is no proof, or does not prove what it says.
    """
    stored = store.load(file, LAYOUT, ratio=certificate_files.MOST_RATIO)
    stated, data = stored["config"], stored["data"]
    (problem, J1), code = _problem(file, stated.get("problem")), str(stated.get("code"))
    try:
        shift, spread = proof_data.unpacked_energies(data["energies"])
        # The energies may be any: the checker proves that those of the line's starts are among
        # them (C6).
        of = problem.body, problem.h0 + exact(shift), spread, problem.h0
        line = proof_data.unpacked_line(J1, data["line"])
        sources = [line, *proof_data.unpacked_quads(data["sets"])]
        if len(sources) != len(code) + 1:
            raise ValueError(
                f"a code of {counted(len(code), 'symbol')}, and {counted(len(sources) - 1, 'set')}"
            )
        parts = []
        for part in _parts(len(sources)):
            proof = proof_data.of_some(data["proof"], len(sources), part)
            parts.append((part.start, [*sources, None][part.start : part.stop], proof))
        proven = chain.from_iterable(_side_by_side(_checked, of, parts, jobs, len(code), report))
        # The first link is the line of starts, which has no symbol.
        if (symbols := "".join(str(int(x)) for x in [*proven][1:])) != code:
            raise Undecided(f"the code is {symbols}")
        # The phases are bounded by the line's first polynomials, of source 0.
        numbers = sections.Numbers.of(*of)
        [begin] = proof_data.unpacked(proof_data.of_some(data["proof"], len(sources), range(1)), 1)
        low, high = sections.phases(numbers, line, begin)
    except (ValueError, Undecided) as error:
        raise files.StoreError(f"{file}: not proven: {short(error)}") from None
    return (
        f"of {problem.words}: one of the starts with {sections.words_on_phases(low, high)}"
        f" has the code of {counted(len(code), 'symbol')} {code}"
    )


def _parts(n: int) -> list[range]:
    """Ranges of n links and None behind them, each of which ends with the first one of the next.

    So the relation between two ranges is checked as well.
    """
    return [range(k, min(k + AT_ONCE, n) + 1) for k in range(0, n, AT_ONCE)]


def _side_by_side(
    work: Callable[..., Result],
    of: tuple[Any, ...],
    parts: Sequence[Any],
    jobs: int,
    passages: int,
    report: Report,
) -> list[Result]:
    """Results of ``work(part, *of, say)`` for each part, side by side, with lines of progress."""
    done = 0

    def hear(_: str) -> None:
        nonlocal done
        done += AT_ONCE
        report(f"{min(passages, done)} of {passages} passages are proven")

    return side_by_side(work, of, True, parts, jobs, hear)


def _made(part: Sequence[Link | None], say: Report) -> dict[str, Any]:
    """The arrays of the polynomials of a part's links but the last one."""
    from rigidpend.routes.certified import chains

    made = proof_data.packed(chains.linked(part))
    say("made")
    return made


def _checked(part: tuple[int, Sequence[Source | None], Mapping[str, Any]], *of: Any) -> list[bool]:
    """The symbols of a part's links; the last one is only covered."""
    *numbers, say = of
    first, sources, proof = part
    orbits = zip(sources, proof_data.unpacked(proof, len(sources)), strict=True)
    links = [source and (source, steps) for source, steps in orbits]
    found = coverings.prove_chain(sections.Numbers.of(*numbers), links, first=first)
    say("checked")
    return found


def _problem(file: Path, stated: Any) -> tuple[Any, Fraction]:
    """The stated problem, checked by the schema of a full shift, and J1_0."""
    try:
        # A name for the figure is all that the schema asks for besides.
        text = {key: stated[key] for key in PROBLEM}
        content: Any = experiments.schema("full_shift").model_validate(
            {"experiment": "full_shift", "figure": "", "problem": text}
        )
        return content.problem, content.problem.J1_0.fraction
    except ValidationError as error:
        raise files.StoreError(f"{file}: {short(validation.told(error.errors()))}") from None
    except (KeyError, TypeError) as error:
        raise files.StoreError(f"{file}: its config lacks {short(error)}") from None
