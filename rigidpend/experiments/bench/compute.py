"""Experiment `bench`: time, error and memory of our methods and of others."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidpend.experiments.bench.layout import PROBLEM
from rigidpend.experiments.contract import Data, Means, Row
from rigidpend.integrate.engines import EngineError, default_engine
from rigidpend.measure.benchmark import problems, records
from rigidpend.measure.benchmark.methods import METHODS, Method
from rigidpend.measure.benchmark.worker import Order, measured
from rigidpend.results.tree import Dataset, Tree

if TYPE_CHECKING:
    from rigidpend.experiments.bench.schema import Config, Problem


PATIENCE, GRACE = 4, 120
"""A worker is ended after so many budgets, and so many seconds more."""
SAME, CHAOTIC = 30, 1e-3
"""By which factor errors may differ, where they are below what chaos makes of them."""


def compute(config: Config, means: Means) -> Tree:
    """Measure every method on every problem, each in a process of its own.

    Parameters
    ----------
    config : Config
    means : Means

    Returns
    -------
    Tree
        A group for each problem, with a record for each method; then `scaling`, with one for
        each method against the number of orbits and of symbols.

    Raises
    ------
    EngineError
        heyoka, which makes the references in 113 bits, is not installed.
    """
    if default_engine() != "taylor":
        raise EngineError("the references need the package heyoka, which is not installed")
    groups = {name: _problem(config, name, means) for name in config.problem.problems}
    return {**groups, "scaling": _scaling(config, groups.get("codes", {}), means)}


def describe(config: Config) -> list[Row]:
    """What a config asks for: for people, units named."""
    p, how = config.problem, config.protocol
    asked = {name: problems.module(name) for name in p.problems}
    return [
        *(Row(name, problem.TITLE, problem.ERROR) for name, problem in asked.items()),
        *(Row(name, METHODS[name].family, METHODS[name].label) for name in p.methods),
        Row("repeats", str(how.repeats), "the median counts"),
        Row("seconds", f"{how.seconds}, {how.long_seconds}", "a method's budget; over long times"),
    ]


def differences(stored: Data, fresh: Data) -> list[str]:
    """Where the errors of two runs disagree by more than rounding explains; times never count.

    What one run alone has measured, for its budget was larger, is passed over, and so is a
    method that one of them lacked.

    Parameters
    ----------
    stored, fresh : dict
        ``/data`` of the two files, loaded.
    """
    found = [f"problem {name} is in one file only" for name in sorted(set(stored) ^ set(fresh))]
    for problem in sorted(set(stored) & set(fresh) - {"scaling"}):
        for method in METHODS:
            pair = [data[problem].get(method, {}) for data in (stored, fresh)]
            if all("error" in record for record in pair):
                found += [f"{problem}, {method}: {text}" for text in _other_errors(*pair)]
    return found


def _other_errors(stored: Data, fresh: Data) -> Iterator[str]:
    fresh_at = {_key(knob): k for k, knob in enumerate(fresh["knob"])}
    for i, knob in enumerate(stored["knob"]):
        k = fresh_at.get(_key(knob))
        if k is None or not stored["error"][i] < CHAOTIC:
            continue
        old, new = stored["error"][i], fresh["error"][k]
        if not new <= SAME * max(old, np.finfo(float).eps):
            yield f"at {knob:g} the error is {new:.2g}, it was {old:.2g}"
        if "wrong_symbols" in stored and fresh["wrong_symbols"][k] > stored["wrong_symbols"][i]:
            yield f"at {knob:g} {fresh['wrong_symbols'][k]:g} symbols are wrong"


def _key(knob: float) -> str:
    return f"{knob:.6g}"


def _problem(config: Config, name: str, means: Means) -> Tree:
    """The records of a problem."""
    problem, sizes = problems.module(name), _sizes(config.problem)
    task = problem.task(sizes)
    truth = means.part(f"{name}.reference", lambda: _arrays(problem.reference(task)))
    means.report(f"{problem.TITLE}: reference")
    group: dict[str, Any] = {
        key: field.dataset(getattr(problem, key.upper())) for key, field in PROBLEM.items()
    }
    with tempfile.TemporaryDirectory() as folder:
        reference = Path(folder) / "reference.npz"
        arrays: dict[str, Any] = {key: node[0] for key, node in truth.items()}  # type: ignore[index]
        np.savez(reference, **arrays)
        for key in config.problem.methods:
            method = METHODS[key]
            if method.answer(name, problem.KIND) is None:
                continue
            knobs = _knobs(method, config.protocol, problem.KIND == "long")
            seconds = _budget(config.protocol, name, key)
            order = Order(
                name,
                key,
                [sizes._asdict()],
                knobs,
                config.protocol.repeats,
                seconds,
                str(reference),
            )
            group[key] = means.part(f"{name}.{key}", lambda: _record(order))  # noqa: B023
            means.report(f"{problem.TITLE}: {method.label}: {_said(group[key])}")
    return group


def _scaling(config: Config, codes: Tree, means: Means) -> Tree:
    """The records of codes against the number of orbits, and of symbols."""
    fixed = _sizes(config.problem)
    asked = {
        "orbits": [fixed._replace(columns=n) for n in config.scaling.orbits],
        "symbols": [fixed._replace(n_symbols=n) for n in config.scaling.symbols],
    }
    groups: dict[str, dict[str, Any]] = {name: {} for name in asked}
    for name, sizes in asked.items():
        for key in config.scaling.methods:
            order = Order(
                "codes",
                key,
                [each._asdict() for each in sizes],
                [_good(codes.get(key), METHODS[key], config.protocol)],
                config.protocol.repeats,
                float(config.scaling.seconds),
                "",
            )
            groups[name][key] = means.part(f"{name}.{key}", lambda: _record(order))  # noqa: B023
            means.report(f"against {name}: {METHODS[key].label}: {_said(groups[name][key])}")
    return groups


def _record(order: Order) -> Tree:
    lacking = METHODS[order.method].absent()
    if lacking:
        return records.absent(lacking)
    lines, ended = measured(order, PATIENCE * order.seconds + GRACE)
    return records.record(lines, ended, len(order.knobs) * len(order.sizes))


def _good(record: Any, method: Method, protocol: Any) -> Any:
    """The loosest knob with which every symbol came out right; without one, the finest."""
    knobs = _knobs(method, protocol, False)
    if record and "wrong_symbols" in record:
        right = np.flatnonzero(record["wrong_symbols"].values == 0)
        if right.size:
            return knobs[right[0]]
    return knobs[-1]


def _knobs(method: Method, protocol: Any, long: bool) -> list[Any]:
    """What a method is tried with, loosest first."""
    if method.knob == "none":
        return [None]
    if method.knob == "steps":
        return list(protocol.long_steps if long else protocol.steps)
    tolerances = protocol.long_tolerances if long else protocol.tolerances
    return [float(x) for x in tolerances if float(x) >= method.finest]


def _budget(protocol: Any, problem: str, method: str) -> float:
    """What a method may take at a problem, seconds."""
    if problem == "long_time":
        return float(protocol.long_seconds)
    given = protocol.code_seconds if problem == "codes" else {}
    return float(given.get(method, protocol.seconds))


def _sizes(problem: Problem) -> problems.Sizes:
    return problems.Sizes(*(getattr(problem, name) for name in problems.Sizes._fields))


def _arrays(reference: Mapping[str, Any]) -> Tree:
    return {key: Dataset(value, "", "the truth") for key, value in reference.items()}


def _said(record: Any) -> str:
    return str(record["ended"].values)
