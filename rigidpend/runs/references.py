"""References: stored results that fresh ones are compared with, and how they are renewed."""

import contextlib
import datetime
import tempfile
from collections.abc import Callable
from pathlib import Path

from rigidpend import experiments
from rigidpend.config import writer
from rigidpend.experiments import compare
from rigidpend.experiments.compare import Difference
from rigidpend.experiments.data import Loaded
from rigidpend.machine import files, wording
from rigidpend.machine.progress import tell_nobody
from rigidpend.results import store
from rigidpend.runs import certificate_files as storage
from rigidpend.runs.loading import LoadedConfig
from rigidpend.runs.runner import plan, run


def verify(
    config: LoadedConfig,
    stored: Path,
    *,
    jobs: int,
    fresh: Path | None = None,
    certificate: Loaded | None = None,
    report: Callable[[str], None] = tell_nobody,
) -> list[Difference]:
    """Differences by value of a stored result, the reference, from a fresh one.

    The fresh result is read, or computed if none is given. Differences of structure come first,
    with attributes and config; if there are none, differences of values, each array with its worst
    element; last the symbols of the fresh result that contradict a certificate. StoreError if a
    file cannot be read, or its values cannot be compared.
    """
    old, outline = store.load_outlined(stored)
    with tempfile.TemporaryDirectory() as folder:
        if fresh is None:
            planned = plan(config, Path(folder))
            run(planned, jobs=jobs, report=report)
            fresh = planned.target
        new, fresh_outline = store.load_outlined(fresh)
    configs = old["config"], new["config"]
    same_numerics = configs[0].get("numerics") == configs[1].get("numerics")
    found = compare.outlines(outline, fresh_outline, same_numerics=same_numerics)
    was, is_ = ({key: x for key, x in one.items() if key != "numerics"} for one in configs)
    changed = writer.changes(was, is_)
    found += [Difference(f"config/{key.replace('.', '/')}", *x) for key, x in changed.items()]
    # Values are compared object by object, which needs equal structures.
    if outline.keys() == fresh_outline.keys():
        layout = experiments.layout(config.content.experiment)
        try:
            found += compare.differences(layout, old["data"], new["data"])
        # A file may hold any values, which may raise any of these in a comparison.
        except (LookupError, ValueError, ZeroDivisionError) as error:
            said = f"{stored}: cannot be compared: {wording.error(error)}"
            raise files.StoreError(said) from None
    if certificate:
        found += storage.contradictions(new, certificate)
    return found


def renew(config: LoadedConfig, target: Path, reason: str, *, jobs: int) -> None:
    """Compute a reference again; its attribute `reasons` gets this reason after earlier ones."""
    files.prepare(target, "choose another folder with --reference")
    before: list[str] = []
    # An absent or damaged reference is renewed too; it has no earlier reasons.
    with contextlib.suppress(files.StoreError):
        before = list(store.attributes(target).get("reasons", []))
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    planned = plan(config, target.parent, force=True)
    reasons = [*before, f"{today} {' '.join(reason.split())}"]
    run(planned, jobs=jobs, report=tell_nobody, further={"reasons": reasons})
