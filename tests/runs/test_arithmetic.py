"""One way for numerics: what a config chooses is resolved once, used, and stored."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest

from rigidpend import experiments
from rigidpend.config import catalogue
from rigidpend.config.complaints import ConfigError
from rigidpend.experiments.contract import Means
from rigidpend.experiments.route_codes import compute as route_codes
from rigidpend.orbits.integrate.arithmetic import (
    CLOSED_FORM,
    DEFAULT_ENGINE,
    DEFAULT_TOLERANCE,
    FINEST_TOLERANCE,
    Arithmetic,
    resolve,
)
from rigidpend.results import store
from rigidpend.runs import loading, runner
from tests.config.samples import SMALL, written

CONFIGS = sorted(catalogue.known().values())
CHOICES: dict[str, tuple[str, Any]] = {
    "engine": ("scipy", "scipy"),
    "tolerance": ("1e-9", 1e-9),
    "precisions": ("[53, 200]", (53, 200)),
}
"""A value of each setting that is not its default, as it is written and as it arrives."""


def means_of(
    path: Path, settings: list[str], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> Means:
    """The means with which the runner calls a config's experiment, which need not go on."""
    compute = Mock(side_effect=KeyboardInterrupt)
    monkeypatch.setattr(experiments, "computation", lambda _: SimpleNamespace(compute=compute))
    planned = runner.plan(loading.load(path, settings), folder, force=True)
    with pytest.raises(KeyboardInterrupt):
        runner.run(planned, jobs=1, report=print)
    [((_, means), _)] = compute.call_args_list
    return means


@pytest.mark.slow
@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.stem)
def test_every_setting_of_numerics_arrives_or_is_refused(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked, chosen = loading.load(path).content.numerics_asked, []
    for setting, (text, _) in CHOICES.items():
        if setting in asked:
            chosen.append(f"numerics.{setting}={text}")
            continue
        with pytest.raises(ConfigError, match="unknown key"):
            loading.load(path, [f"numerics.{setting}={text}"])
    if not asked:
        assert means_of(path, [], tmp_path, monkeypatch).arithmetic is CLOSED_FORM
        return
    changed, plain = (means_of(path, x, tmp_path, monkeypatch).arithmetic for x in (chosen, []))
    for setting, (_, value) in CHOICES.items():
        if setting in asked:
            assert getattr(changed, setting) == value
            assert getattr(plain, setting) != value


@pytest.mark.slow
@pytest.mark.parametrize("asked", ["1e-20", "auto", "1e-9"])
def test_the_tolerance_in_the_file_is_the_one_that_was_used(
    asked: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A tolerance finer than the engine can keep is stored as the finest, not as written."""
    compute = Mock(wraps=route_codes.compute)
    monkeypatch.setattr(route_codes, "compute", compute)
    path = written(tmp_path, SMALL, "small.yaml")
    planned = runner.plan(loading.load(path, [f"numerics.tolerance={asked}"]), tmp_path)
    runner.run(planned, jobs=1, report=print)
    stored, engine = store.attributes(planned.target), DEFAULT_ENGINE
    by_asked = {"1e-20": FINEST_TOLERANCE, "auto": DEFAULT_TOLERANCE, "1e-9": {engine: 1e-9}}
    [((_, means), _)] = compute.call_args_list
    assert stored["tolerance"] == by_asked[asked][engine] == means.arithmetic.tolerance
    assert tuple(stored["precisions"]) == means.arithmetic.precisions


def test_resolving_what_is_resolved_changes_nothing() -> None:
    once = resolve("scipy", "1e-20", (53, 64, 200))
    assert once == Arithmetic("scipy", FINEST_TOLERANCE["scipy"], (53, 200))
    assert resolve(*once) == once
