"""Certificates of whole configs: made, kept while they are made, and checked again."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rigidpend import experiments
from rigidpend.certified import codes, extra, storage
from rigidpend.config.complaints import Complaint, ConfigError, Origin
from rigidpend.config.loading import LoadedConfig
from rigidpend.numbers.exact import Exact, exact
from rigidpend.numbers.parameters import ExactError, ParameterError
from rigidpend.results import store, words
from rigidpend.results.files import Absent
from rigidpend.results.layout import datasets
from rigidpend.results.tree import Data, Tree
from rigidpend.routes.problem import RouteProblem
from rigidpend.run import provenance
from rigidpend.run.parts import Parts

if TYPE_CHECKING:
    from rigidpend.certified.codes import CertifiedCodes

AT_ONCE = 32
"""Orbits that are proven, and kept, at a time: a minute or so."""
MOST_ORBITS = 2000
"""Orbits of a certificate at most: each takes about half a megabyte."""

Report = Callable[[str], None]


class Summary(NamedTuple):
    """Summary of the certificate of an array of orbits."""

    array: str
    orbits: int
    symbols: int
    proven: int
    undecided: list[str]
    """A line for each orbit that is not proven throughout: phase, symbol and reason."""


def target(config: LoadedConfig, folder: Path) -> Path:
    """File of a config's certificate."""
    return storage.certificate_of(folder / f"{config.name}.h5")


def certify(
    config: LoadedConfig, folder: Path, *, jobs: int, report: Report, force: bool = False
) -> list[Summary]:
    """Prove the route codes of a config and write its certificate, unless it is up to date.

    Parameters
    ----------
    config : LoadedConfig
    folder : Path
        Where results are kept, and the certificate beside them.
    jobs : int
        Processes; no certificate depends on it.
    report : callable
        Takes lines of progress.
    force : bool, optional
        Prove even what is up to date.

    Raises
    ------
    ConfigError
        The experiment has no route codes, or too many orbits.
    StoreError
        A file cannot be read or written.
    """
    routes, file = orbits(config, folder), target(config, folder)
    fingerprint = _fingerprint(config, routes)
    if not force and file.exists():
        stored = storage.read(file)
        if all(stored["attributes"].get(key) == value for key, value in fingerprint.items()):
            report(f"{file} is up to date")
            return summaries(stored["data"])
    store.prepare(file)
    # Kept under the fingerprint: parts of other orbits or of other code do not count.
    with Parts(file, provenance.config_hash(fingerprint)) as parts:
        data = {
            name: _array(name, problem, phases, parts, jobs, report)
            for name, (problem, phases) in routes.items()
        }
        attributes = {"name": config.name, "experiment": config.experiment, **fingerprint}
        resolved = json.dumps(config.resolved(), indent=2)
        made = provenance.provenance() | {"version_python_flint": extra.version()}
        store.write(file, store.Result(attributes, resolved, made, data))
        # Not before the whole file stands.
        parts.drop()
    report(f"{file} written")
    return summaries(storage.read(file)["data"])


def orbits(
    config: LoadedConfig, folder: Path
) -> Mapping[str, tuple[RouteProblem, Sequence[Exact]]]:
    """The exact orbits of a config whose route codes can be proven.

    Raises
    ------
    ConfigError
        It has none, or too many.
    Absent
        They are told by a result that is not there.
    """
    computation: Any = experiments.computation(config.experiment)
    if not hasattr(computation, "orbits"):
        raise _refused(config, f"the experiment {config.experiment} has no route codes to prove")
    source = folder / f"{config.name}.h5"
    found = computation.orbits(config.content, partial(_stored, source))
    count = sum(len(phases) for _, phases in found.values())
    if count > MOST_ORBITS:
        raise _refused(config, f"{count} orbits, and {MOST_ORBITS} are the most in a certificate")
    return dict(found)


def check(file: Path, *, jobs: int, report: Report) -> list[Summary]:
    """Check the proof in a certificate again, without integration.

    Parameters
    ----------
    file : Path
    jobs : int
    report : callable
        Takes lines of progress.

    Raises
    ------
    StoreError
        It is no certificate, or does not prove all that it says.
    """
    stored = storage.read(file)
    text = json.loads(stored["config"])
    for name, group in stored["data"].items():
        try:
            # Of all that the file says, its config, phases and steps are taken, to be proven again.
            problem, phases = _problem(text), [exact(str(x)) for x in group["theta2_0"]]
            steps = storage.unpacked(group)
        except (store.StoreError, ExactError, ParameterError, KeyError, TypeError) as error:
            raise store.StoreError(f"{file}: {name}: {error}") from None
        found = codes.checked_codes(problem, phases, steps, jobs)
        _compare(f"{file}: {name}", group, found)
        report(f"{name}: {int(found.proven.sum())} symbols of {len(phases)} orbits proven again")
    return summaries(stored["data"])


def summaries(data: Data) -> list[Summary]:
    """Count what a certificate says, array by array."""
    return [_summary(name, group) for name, group in data.items()]


def _summary(name: str, group: Data) -> Summary:
    proven, undecided = group["proven"], []
    for column, reason in enumerate(group["reason"]):
        if reason:
            symbols = int(proven[:, column].sum())
            undecided.append(
                f"theta2_0 = {group['theta2_0'][column]}: {symbols} of {len(proven)} symbols;"
                f" then {reason}"
            )
    return Summary(name, proven.shape[1], proven.size, int(proven.sum()), undecided)


def _array(
    name: str,
    problem: RouteProblem,
    phases: Sequence[Exact],
    parts: Parts,
    jobs: int,
    report: Report,
) -> Tree:
    found: list[Any] = []
    for first in range(0, len(phases), AT_ONCE):
        some = [phases[k] for k in range(first, min(first + AT_ONCE, len(phases)))]
        found.append(parts.keep(f"{name}.{first:08d}", partial(_part, problem, some, jobs)))
        report(f"{name}: {first + len(some)} of {len(phases)} orbits")
    # Columns come last in every field, and so do steps and bytes: parts join at their ends.
    joined = {
        field: np.concatenate([part[field].values for part in found], axis=-1)
        for field in (*storage.FIELDS, *storage.PROOF)
    }
    return datasets({**storage.FIELDS, **storage.PROOF}, joined)


def _part(problem: RouteProblem, phases: Sequence[Exact], jobs: int) -> Tree:
    found = codes.certify_codes(
        problem.body,
        phases,
        h0=problem.h0,
        J1_0=problem.J1_0,
        n_symbols=problem.n_symbols,
        jobs=jobs,
    )
    told = found._asdict() | {
        "theta2_0": np.array([_text(phase).encode() for phase in phases], dtype=bytes),
        "reason": np.array([reason.encode() for reason in found.reason], dtype=bytes),
    }
    return datasets(storage.FIELDS, told) | datasets(storage.PROOF, storage.packed(found.steps))


def _text(phase: Exact) -> str:
    """Shortest text that says a phase exactly, where it is rational."""
    return phase.text if phase.fraction is None else exact(phase.fraction).text


def _compare(place: str, group: Data, found: CertifiedCodes) -> None:
    """Refuse a certificate that says more, or other, than its steps prove."""
    for field in ("codes", "proven", "separatrix", "crossing_time", "time_radius", "bound"):
        stated, again = group[field], getattr(found, field)
        if stated.shape != again.shape:
            raise store.StoreError(f"{place}: {field} is not of as many symbols as its config says")
        # NaN, which equals nothing, stands on both sides where no crossing is proven.
        wrong = np.argwhere((stated != again) & ~((stated != stated) & (again != again)))
        if wrong.size:
            row, column = wrong[0]
            told = f"{field} in row {row + 1} of column {column}"
            why = f": {found.reason[column]}" if found.reason[column] else ""
            raise store.StoreError(f"{place}: its steps do not prove {told}{why}")


def _problem(config: Any) -> RouteProblem:
    """The problem of a stored config, of which nothing else is used."""
    from rigidpend.body import Body

    given = config.get("problem")
    if not isinstance(given, dict):
        raise store.StoreError(f"its config has no keys under problem, but {words.short(given)}")
    body = Body(A=given["A"], r=given["r"], mu=given["mu"])
    return RouteProblem(body, exact(given["h0"]), exact(given["J1_0"]), given["n_symbols"])


def _stored(source: Path) -> Data:
    if not source.exists():
        raise Absent(f"{source} is not there; call: rigidpend run {source.stem}")
    return store.load(source)["data"]


def _fingerprint(config: LoadedConfig, routes: Mapping[str, Any]) -> dict[str, str]:
    phases = {name: [x.text for x in phases] for name, (_, phases) in routes.items()}
    return {
        "config_hash": provenance.config_hash(config.resolved()),
        "code_hash": provenance.code_hash_of(Path(codes.__file__)),
        # Zooms tell their phases by a result, which the config's hash knows nothing of.
        "orbits_hash": provenance.config_hash(phases),
    }


def _refused(config: LoadedConfig, message: str) -> ConfigError:
    return ConfigError([Complaint(Origin(config.name), ("experiment",), message)])
