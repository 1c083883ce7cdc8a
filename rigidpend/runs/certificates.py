"""Certificates of whole configs: made in parts that outlive a stop, and checked again."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from rigidpend import experiments
from rigidpend.config import validation
from rigidpend.config.complaints import Complaint, ConfigError, Origin
from rigidpend.experiments.contract import Piece, Routes
from rigidpend.experiments.data import Data, Loaded, Tree
from rigidpend.machine import files
from rigidpend.machine.code_hash import code_hash_of
from rigidpend.machine.progress import PartDone, tell_nobody
from rigidpend.machine.wording import counted, short
from rigidpend.numbers.exact import Exact, exact
from rigidpend.numbers.texts import NO_SYMBOL, ExactError, as_written
from rigidpend.results import store
from rigidpend.routes.certified import codes
from rigidpend.routes.certified.codes import CertifiedCodes, Report
from rigidpend.routes.problem import RouteProblem
from rigidpend.runs import certificate_files as storage
from rigidpend.runs import cluster, loading, orbit_proofs, provenance
from rigidpend.runs.loading import LoadedConfig
from rigidpend.runs.parts import Parts

AT_ONCE = 32
"""Orbits of a part, which are proven and stored together: a minute or so."""
MOST_ORBITS = 2000
"""Largest number of orbits in a certificate: each takes about half a megabyte."""
PHASE = 24
"""Characters of a phase that are printed."""
OF_PART = (*storage.FIELDS, *storage.PROOF, "reason")
"""Fields of a part; the whole certificate leaves out `reason`, why something is undecided."""


class Summary(NamedTuple):
    """A summary of what a certificate says of an array of orbits."""

    array: str
    orbits: int
    symbols: int
    proven: int
    undecided: list[str]
    """A line for each orbit that is not wholly proven: column, phase, symbols, perhaps a reason."""

    def __str__(self) -> str:
        counted = f"{self.proven} of {self.symbols} symbols of {self.orbits} orbits proven"
        return "\n".join(
            [f"{self.array}: {counted}", *(f"  undecided: {x}" for x in self.undecided)]
        )


class Theorem(NamedTuple):
    """A sentence that a result proves, or that says what is undecided."""

    said: str

    def __str__(self) -> str:
        return self.said if self.said.startswith("undecided: ") else f"proven: {self.said}"


def certify(
    config: LoadedConfig,
    folder: Path,
    *,
    jobs: int,
    report: Report,
    force: bool = False,
    scheduler: str | None = None,
) -> list[Summary]:
    """Prove the route codes of a config and write its certificate, unless it is up to date.

    The file lies in the folder of results, beside the config's. `force` proves even what is up to
    date; `jobs` processes prove, or a Dask cluster at the address `scheduler`. ConfigError where
    the experiment has no route codes or too many orbits, StoreError where a file cannot be read or
    written.
    """
    routes = orbits(config, folder)
    file = storage.certificate_of(folder / f"{config.name}.h5")
    stated, code = _stated(config.content), code_hash_of(Path(codes.__file__))
    texts = {name: [x.shortest.text for x in phases] for name, (_, phases) in routes.items()}
    if not force and file.exists():
        stored = storage.read(file)
        of = stored["config"], stored["provenance"].get("code_hash")
        at = {name: group["theta2_0"].tolist() for name, group in stored["data"].items()}
        if (*of, at) == (stated, code, texts):
            report(f"{file} is up to date; certify --check {file} proves it again")
            return summaries(stored["data"])
    files.prepare(file)
    reasons: dict[str, list[str]] = {}
    # Parts are stored under a hash of all that they depend on: those of other orbits or of other
    # code do not count.
    parts = Parts(file, provenance.config_hash({"of": stated, "at": texts, "code": code}))
    data = {}
    for name, (problem, phases) in routes.items():
        # On a cluster each piece is one orbit for one worker.
        pieces = _pieces(
            name, problem, phases, parts.has, *((1, tell_nobody) if scheduler else (jobs, report))
        )
        proofs = parts.in_order(pieces)
        if scheduler:
            given = config.content.experiment, "taylor", parts, pieces, report
            proofs = cluster.computed(scheduler, *given)
        data[name] = _joined(proofs, name, len(phases), report)
        reasons[name] = [x.decode() for x in data[name]["reason"]]
    made = provenance.provenance() | {"code_hash": code} | provenance.of_workers(parts.crew)
    store.write(file, storage.LAYOUT, data, {}, stated, made)
    # Not before the whole file is written: a stop until then loses one part at most.
    parts.drop()
    report(f"{file} written")
    return summaries(storage.read(file)["data"], reasons)


def orbits(config: LoadedConfig, folder: Path) -> Routes:
    """The exact orbits of a config whose route codes can be proven: array, problem and phases.

    ConfigError where there are none or too many; Absent where a stored result is needed to tell
    them, and there is none.
    """
    computation: Any = experiments.computation(config.content.experiment)
    refused = f"the experiment {config.content.experiment} has no route codes to prove"
    if hasattr(computation, "orbits"):
        source = folder / f"{config.name}.h5"
        found = computation.orbits(config.content, lambda: store.load(source)["data"])
        if (count := sum(len(phases) for _, phases in found.values())) <= MOST_ORBITS:
            return dict(found)
        refused = f"{count} orbits: a certificate holds at most {MOST_ORBITS}"
    raise ConfigError([Complaint(Origin(config.name), ("experiment",), refused)])


def check(file: Path, *, jobs: int, report: Report) -> Sequence[Summary | Theorem]:
    """Check the proof in a certificate, or in a result that holds one, without integration.

    StoreError where the file holds no proof, or does not prove all that it says.
    """
    if orbit_proofs.is_proof(file):
        return [Theorem(orbit_proofs.check(file, jobs, report))]
    if not storage.is_certificate(file):
        config = loading.load(file)
        computation: Any = experiments.computation(config.content.experiment)
        if not hasattr(computation, "theorems"):
            lacking = "neither a certificate, which rigidpend certify writes, nor"
            raise files.StoreError(f"{file}: {lacking} a result with a proof")
        data = store.load(file)["data"]
        try:
            content: Any = config.content
            if not (told := computation.theorems(content, data)):
                raise ValueError("its proof has no theorem")
            return [Theorem(f"of {content.problem.words}: {told[0]}"), *map(Theorem, told[1:])]
        # The file may be anybody's: its arrays need not describe sets or steps.
        except (ArithmeticError, ValueError) as doubt:
            raise files.StoreError(f"{file}: undecided, nothing is proven: {doubt}") from None
    stored = storage.read(file)
    for name, (problem, phases) in _routes(file, stored).items():
        place, group = f"{file}: {name}", stored["data"][name]
        _fits(place, group, problem, phases)
        try:
            # Of all that the file says only its config and its steps are used for the proof; its
            # symbols are then compared with what that proves.
            steps = storage.unpacked(group)
        except files.StoreError as error:
            raise files.StoreError(f"{place}: {error}") from None
        found = codes.checked_codes(problem, phases, steps, jobs)
        _compare(place, group["codes"], found)
        proven = int((group["codes"] != NO_SYMBOL).sum())
        report(
            f"{name}: {counted(proven, 'symbol')} of {counted(len(phases), 'orbit')} proven again"
        )
    return summaries(stored["data"])


def summaries(data: Data, reasons: Mapping[str, Sequence[str]] | None = None) -> list[Summary]:
    """Summaries of what a certificate says, array by array.

    A certificate does not say why something is undecided: `reasons` has, by array, a text for each
    column that was proven just now.
    """
    found = []
    for name, group in data.items():
        proven, undecided, why = group["codes"] != NO_SYMBOL, [], (reasons or {}).get(name)
        for column in map(int, np.flatnonzero(~proven.all(axis=0))):
            counted = f"{int(proven[:, column].sum())} of {len(proven)} symbols"
            # The column tells more than a phase of a hundred digits, which is shortened.
            phase = short(as_written(str(group["theta2_0"][column])), PHASE)
            then = f"; then {why[column]}" if why else ""
            undecided.append(f"column {column}, theta2_0 = {phase}: {counted}{then}")
        found.append(Summary(name, proven.shape[1], proven.size, int(proven.sum()), undecided))
    return found


def _stated(content: Any) -> dict[str, Any]:
    """The config that a certificate states: the experiment and the whole problem, no more."""
    resolved = content.model_dump(mode="json")
    return {key: resolved[key] for key in ("experiment", "problem")}


def _routes(file: Path, stored: Loaded) -> Routes:
    """The orbits that a certificate's own config asks for; StoreError if its arrays are others."""
    try:
        # The schema takes numbers as texts, so that none is rounded to a double on the way.
        text = json.loads(json.dumps(stored["config"]), parse_int=str, parse_float=str)
        content = experiments.schema(text["experiment"]).model_validate(text)
        if _stated(content) != stored["config"]:
            raise ValueError("it is not written as a certificate writes it")
        computation: Any = experiments.computation(content.experiment)
        found = dict(computation.orbits(content, partial(_centres, stored["data"])))
    except ValidationError as error:
        said = short(validation.told(error.errors()))
        raise files.StoreError(f"{file}: its config: {said}") from None
    # The file may be anybody's: what is no config ends in one of these errors.
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError) as error:
        raise files.StoreError(f"{file}: its config cannot be used: {short(error)}") from None
    except ValueError as error:
        raise files.StoreError(f"{file}: its config: {short(error)}") from None
    if lacking := sorted(found.keys() - stored["data"].keys()):
        raise files.StoreError(
            f"{file}: {lacking[0]}: its config asks for this array, which is missing"
        )
    if more := sorted(stored["data"].keys() - found.keys()):
        raise files.StoreError(f"{file}: {more[0]}: its config does not ask for this array")
    if sum(len(phases) for _, phases in found.values()) > MOST_ORBITS:
        raise files.StoreError(f"{file}: its config asks for more than {MOST_ORBITS} orbits")
    return found


def _centres(data: Data) -> Data:
    """The part of its result that a zoom needs: each level's centre, from the stated phases."""
    return {"levels": {name: {"centre": storage.centre(group)} for name, group in data.items()}}


def _fits(place: str, group: Data, problem: RouteProblem, phases: Sequence[Exact]) -> None:
    """Refuse an array that is not of the orbits that the config asks for, by StoreError."""
    shape = (problem.n_symbols, len(phases))
    if group["codes"].shape != shape:
        asked = f"{counted(shape[0], 'symbol')} of {counted(shape[1], 'orbit')}"
        raise files.StoreError(f"{place}: codes: its config asks for {asked}")
    for column, (said, phase) in enumerate(zip(group["theta2_0"], phases, strict=True)):
        if not _same(str(said), phase):
            told = f"theta2_0 of column {column} is {short(said, 60)}"
            raise files.StoreError(
                f"{place}: {told}, and its config asks for {phase.shortest.text}"
            )


def _same(text: str, phase: Exact) -> bool:
    """True if a text says a phase; irrational ones are compared to thousands of bits."""
    if text == phase.shortest.text:
        return True
    try:
        apart = exact(text) - phase
        return phase.fraction is None and apart.at(53) == 0
    except ExactError:
        return False


def _pieces(
    name: str,
    problem: RouteProblem,
    phases: Sequence[Exact],
    stored: Callable[[str], bool],
    jobs: int,
    report: Report,
) -> list[Piece]:
    """The proofs of an array, some orbits at a time, or as many as a stored part has."""
    # Several processes share the orbits of a piece; with one, each orbit is stored at once.
    at_once, found, k = AT_ONCE if jobs > 1 else 1, list[Piece](), 0
    while k < len(phases):
        # The name tells how many orbits: an interrupted run may have proven others at a time.
        counts = [min(n, len(phases) - k) for n in (at_once, AT_ONCE, 1)]
        names = {n: f"{name}.{k:08d}.{n}" for n in counts}
        # Those of a cluster, each of one orbit, are stored in any order.
        alone = any(stored(f"{name}.{i:08d}.1") for i in range(k, k + counts[0]))
        count = next((n for n in names if stored(names[n])), 1 if alone else counts[0])
        few = [phases[i] for i in range(k, k + count)]
        found.append(Piece(names[count], partial(_part, problem, few, jobs, report)))
        k += count
    return found


def _joined(proofs: Iterable[Tree], name: str, count: int, report: Report) -> dict[str, Any]:
    """The fields of all parts of an array, joined."""
    found, done = list[Any](), 0
    for part in proofs:
        found.append(part)
        done += len(found[-1]["theta2_0"])
        report(PartDone(f"{name}: {done} of {count} orbits", done, count))
    # Columns, steps, coefficients and bytes are the last dimension of each field: parts join there.
    return {k: np.concatenate([part[k] for part in found], axis=-1) for k in OF_PART}


def _part(problem: RouteProblem, phases: Sequence[Exact], jobs: int, report: Report) -> Tree:
    found = codes.proven_codes(problem, phases, None, jobs, report)
    told = (
        found._asdict()
        | storage.packed(found.steps)
        | {
            "theta2_0": np.array([phase.shortest.text.encode() for phase in phases], dtype=bytes),
            "reason": np.array([reason.encode() for reason in found.reason], dtype=bytes),
        }
    )
    return {name: told[name] for name in OF_PART}


def _compare(place: str, stated: Any, found: CertifiedCodes) -> None:
    """Refuse a certificate that claims a symbol which its steps do not prove, by StoreError."""
    wrong = np.argwhere((stated != found.codes) & (stated != NO_SYMBOL))
    if wrong.size:
        row, column = wrong[0]
        told = f"codes in row {row + 1} of column {column}"
        why = f": {found.reason[column]}" if found.reason[column] else ""
        raise files.StoreError(f"{place}: its steps do not prove {told}{why}")
