"""One way for numerics: what a config chooses is resolved once, used, and stored."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rigidpend import experiments
from rigidpend.config import catalogue
from rigidpend.config.complaints import ConfigError
from rigidpend.experiments.contract import Means
from rigidpend.orbits.integrate.arithmetic import (
    CLOSED_FORM,
    DEFAULT_TOLERANCE,
    FINEST_TOLERANCE,
    Arithmetic,
    NumericsError,
    default_engine,
    resolve,
)
from rigidpend.results import store
from rigidpend.runs import loading, runner
from tests.config.samples import SMALL, changed, written

CONFIGS = sorted(catalogue.known().items())
CHOICES = {"engine": "scipy", "tolerance": "1e-9", "precisions": "[53, 200]"}
"""A value of each setting that is not its default."""


class Stopped(Exception):
    """The computation was reached; it need not go on."""


def means_of(path: Path, settings: list[str], monkeypatch: pytest.MonkeyPatch) -> Means:
    """The means with which the runner calls a config's experiment."""
    seen: list[Means] = []

    class Spy:
        def compute(self, config: Any, means: Means) -> Any:
            seen.append(means)
            raise Stopped

    monkeypatch.setattr(experiments, "computation", lambda _: Spy())
    planned = runner.plan(loading.load(path, settings), path.parent / "out", force=True)
    with pytest.raises(Stopped):
        runner.run(planned, jobs=1, report=print)
    [means] = seen
    return means


@pytest.mark.slow
@pytest.mark.parametrize(("name", "path"), CONFIGS, ids=[name for name, _ in CONFIGS])
@pytest.mark.parametrize("setting", CHOICES)
def test_every_setting_of_numerics_arrives_or_is_refused(
    name: str, path: Path, setting: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = written(tmp_path, path.read_text(encoding="utf-8"), f"{name}.yaml")
    chosen = f"numerics.{setting}={CHOICES[setting]}"
    if setting not in loading.load(copy).content.numerics_asked:
        with pytest.raises(ConfigError, match="unknown key"):
            loading.load(copy, [chosen])
        return
    changed = means_of(copy, [chosen], monkeypatch).arithmetic
    plain = means_of(copy, [], monkeypatch).arithmetic
    expected = {"engine": "scipy", "tolerance": 1e-9, "precisions": (53, 200)}
    assert getattr(changed, setting) == expected[setting]
    assert getattr(plain, setting) != expected[setting] or default_engine() == "scipy"


def test_a_closed_form_has_no_engine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, catalogue.known()["fig1"].read_text(encoding="utf-8"), "fig1.yaml")
    assert means_of(path, [], monkeypatch).arithmetic is CLOSED_FORM


@pytest.mark.slow
@pytest.mark.parametrize("asked", ["1e-20", "auto", "1e-9"])
def test_the_tolerance_in_the_file_is_the_one_that_was_used(
    asked: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A tolerance finer than the engine can keep is stored as the finest, not as written."""
    path = written(tmp_path, changed("problem:", "problem:", SMALL), "small.yaml")
    used: list[Arithmetic] = []
    module = experiments.computation("route_codes")

    def compute(config: Any, means: Means) -> Any:
        used.append(means.arithmetic)
        return module.compute(config, means)

    spy = type("Spy", (), {"compute": staticmethod(compute)})()
    monkeypatch.setattr(experiments, "computation", lambda _: spy)
    planned = runner.plan(loading.load(path, [f"numerics.tolerance={asked}"]), tmp_path)
    runner.run(planned, jobs=1, report=print)
    stored, engine = store.attributes(planned.target), default_engine()
    by_asked = {"1e-20": FINEST_TOLERANCE, "auto": DEFAULT_TOLERANCE, "1e-9": {engine: 1e-9}}
    assert stored["tolerance"] == by_asked[asked][engine] == used[0].tolerance
    assert tuple(stored["precisions"]) == used[0].precisions


def test_resolving_what_is_resolved_changes_nothing() -> None:
    once = resolve("scipy", "1e-20", (53, 64, 200))
    assert once == Arithmetic("scipy", FINEST_TOLERANCE["scipy"], (53, 200))
    assert resolve(*once) == once


@pytest.mark.parametrize(
    ("field", "given"),
    [
        ("tolerance", {"tolerance": 0.0}),
        ("tolerance", {"tolerance": 0.0101}),
        ("tolerance", {"tolerance": "nan"}),
        ("precisions", {"precisions": ()}),
        ("precisions", {"precisions": (52, 113)}),
        ("precisions", {"precisions": (113, 53)}),
        ("precisions", {"precisions": (53.5,)}),
    ],
)
def test_a_choice_that_cannot_be_used_names_its_field(field: str, given: dict[str, Any]) -> None:
    with pytest.raises(NumericsError) as caught:
        resolve("scipy", **given)
    assert caught.value.field == field
    assert str(caught.value).startswith(field)
