"""References: stored results that fresh ones are compared with, and how they are renewed."""

from __future__ import annotations

import contextlib
import datetime
import math
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from rigidpend import experiments
from rigidpend.config import writer
from rigidpend.experiments import compare
from rigidpend.experiments.compare import Difference
from rigidpend.experiments.data import Loaded
from rigidpend.machine import files, wording
from rigidpend.machine.progress import tell_nobody
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.arithmetic import COARSEST_TOLERANCE, resolve
from rigidpend.results import store
from rigidpend.runs import certificate_files as storage
from rigidpend.runs.loading import LoadedConfig
from rigidpend.runs.runner import plan, run

COARSER = 10
"""Factor between the two tolerances by which DOP853's own error is measured."""
Report: TypeAlias = Callable[[str], None]


def verify(
    config: LoadedConfig,
    stored: Path,
    *,
    jobs: int,
    fresh: Path | None = None,
    certificate: Loaded | None = None,
    report: Report = tell_nobody,
) -> list[str]:
    """Say where a stored result, the reference, differs by value from a fresh one.

    The fresh one is read, or computed if there is none. First come differences in what the files
    consist of, attributes and config included; where that is the same, those in the values, each
    array with its worst element. Last the symbols in which the fresh one contradicts a certificate,
    which proves them. StoreError where a file cannot be read, or its values cannot be compared.
    """
    old, outline = store.load_outlined(stored)
    with tempfile.TemporaryDirectory() as folder:
        if fresh is None:
            fresh = _computed(config, Path(folder), jobs, report)
        new, fresh_outline = store.load_outlined(fresh)
    configs = old["config"], new["config"]
    same_numerics = configs[0].get("numerics") == configs[1].get("numerics")
    found: list[str] = [*compare.outlines(outline, fresh_outline, same_numerics=same_numerics)]
    changed = writer.changes(_problem(old["config"]), _problem(new["config"]))
    found += [Difference(f"config/{key.replace('.', '/')}", *x) for key, x in changed.items()]
    # Values are compared place by place, which only equal structures allow.
    if outline.keys() == fresh_outline.keys():
        layout = experiments.layout(config.experiment)
        try:
            found += compare.differences(layout, old["data"], new["data"])
        # A file may hold any values: what a comparison makes of them cannot be foreseen.
        except (LookupError, ValueError, ZeroDivisionError) as error:
            said = f"{stored}: cannot be compared: {wording.error(error)}"
            raise files.StoreError(said) from None
    if certificate:
        found += storage.contradictions(new, certificate)
    return found


def _computed(config: LoadedConfig, folder: Path, jobs: int, report: Report) -> Path:
    planned = plan(config, folder)
    run(planned, jobs=jobs, report=report)
    return planned.target


def is_of(config: LoadedConfig, stored: Path) -> bool:
    """True if a stored result answers the problem of a config, by whatever numerics."""
    if not stored.exists():
        return False
    return _problem(store.load(stored)["config"]) == _problem(config.resolved())


class Referee(NamedTuple):
    """Verdict of DOP853 on a result by Taylor series, with its own error weighed."""

    differences: list[str]
    """Values in which it contradicts the result, which is called stored."""
    undecided: list[str]
    """Values in which it differs by no more than its own error."""
    tolerances: tuple[float, float]
    """Its tolerance, and the coarser one by which its own error was measured."""


def verify_by_engines(config: LoadedConfig, *, jobs: int, report: Report = tell_nobody) -> Referee:
    """Say where the two engines, Taylor series and DOP853, disagree on a config.

    Where they do, DOP853 computes once more at a tolerance `COARSER` times as large. What this
    changes is at least its own error, by which it accuses nobody. Absent where the
    experiment is in closed form, and there is no second engine.
    """
    if not config.content.numerics_asked:
        raise files.Absent(
            f"{config.name} has no stored reference, and is in closed form: no second engine"
            " computes one"
        )
    asked = {**config.content.numerics_asked, "engine": "scipy"}
    fine = resolve(**asked).tolerance
    tolerances = fine, min(COARSER * fine, COARSEST_TOLERANCE)
    with tempfile.TemporaryDirectory() as folder:

        def computed(name: str, config: LoadedConfig) -> Path:
            by = Path(folder, name)
            return _computed(config, by, jobs, lambda text: report(f"by {name}: {text}"))

        def differences(one: Path, other: Path) -> list[str]:
            return verify(config, one, jobs=jobs, fresh=other)

        ours = computed("Taylor series", config.with_engine("taylor"))
        theirs = computed("DOP853", config.with_engine("scipy"))
        found = differences(ours, theirs)
        if not found or "tolerance" not in asked:
            return Referee(found, [], tolerances)
        rough = config.with_engine("scipy", exact(tolerances[1]))
        own = {_array(x): _size(x) for x in differences(computed("DOP853, coarser", rough), theirs)}
    # What an engine is certain of is its own affair: the other one may know less.
    excused = [
        x for x in found if _array(x).endswith("certain") or _size(x) <= own.get(_array(x), -1.0)
    ]
    return Referee([x for x in found if x not in excused], excused, tolerances)


def _array(difference: str) -> str:
    """Array that a difference is in."""
    return str(getattr(difference, "place", difference)).partition("[")[0]


def _size(difference: str) -> float:
    """Size of a difference; infinite of what is no number, or a gap."""
    try:
        size = abs(float(difference.stored) - float(difference.computed))  # type: ignore[attr-defined]
    except (AttributeError, TypeError, ValueError):
        return math.inf
    return size if math.isfinite(size) else math.inf


def _problem(config: dict[str, Any]) -> dict[str, Any]:
    """Problem of a config: without its numerics, and the name of its figure."""
    return {key: x for key, x in config.items() if key not in ("numerics", "figure")}


def renew(config: LoadedConfig, target: Path, reason: str, *, jobs: int) -> None:
    """Compute a reference again; its attribute `reasons` keeps why, and the reasons before."""
    before: list[str] = []
    # One that is absent or damaged is renewed as well, with no earlier reasons to keep.
    with contextlib.suppress(store.StoreError):
        before = list(store.attributes(target).get("reasons", []))
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    planned = plan(config, target.parent, force=True)
    reasons = [*before, f"{today} {' '.join(reason.split())}"]
    run(planned, jobs=jobs, report=tell_nobody, further={"reasons": reasons})
