"""A run that goes on from kept parts writes the file that it would have written at once."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidpend.results import store
from rigidpend.runs import loading, runner
from rigidpend.runs.parts import Parts
from tests.config.samples import FIG4

TIMES = ("seconds", "created")
"""Attributes that tell times: of the run, and of the day."""


def seen(path: Path) -> tuple[Any, str]:
    """The data of a file, and all that can be told of its objects in their order but the times."""
    loaded, outline = store.load_outlined(path)
    for attributes in outline.values():
        for name in TIMES:
            attributes.pop(name, None)
    return loaded["data"], repr(outline)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("fig3", ["problem.bodies={b: [2, 1.04, 1.7], c: [2, 1, 1.2]}"]),
        ("asymptotic_orbits", ["problem.symbols=1", "problem.columns=30", "problem.drawn=1"]),
        (
            "exponents",
            ["problem.theta2_0.count=4", "problem.log10_J1_0.count=3", "problem.checked=2"],
        ),
        (
            "splitting",
            [
                "problem.bodies={c: {A: [2, 1, 1.2], r: [1, 1, 0]}}",
                "problem.drawn=c",
                "problem.mu=[1e-2, 0.1]",
                "problem.phases=9",
            ],
        ),
        ("route_map", ["problem.theta2_0.count=6", "problem.rows.count=4", "problem.zooms={}"]),
    ],
)
def test_a_resumed_file_is_the_fresh_one_but_for_its_times(
    tmp_path: Path, name: str, settings: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    config = FIG4.with_name(f"{name}.yaml")
    planned = runner.plan(loading.load(config, settings), tmp_path, force=True)
    monkeypatch.setattr(Parts, "drop", lambda _: None)
    runner.run(planned, jobs=1, report=lambda _: None)
    fresh = tmp_path / "fresh.h5"
    shutil.move(planned.target, fresh)
    parts = sorted((tmp_path / f".{name}.parts").rglob("*.kept"))
    # As if it had been interrupted: one was not finished, all others were.
    if len(parts) > 1:
        parts[-1].unlink()
    said: list[str] = []
    runner.run(planned, jobs=1, report=said.append)
    assert said[0].startswith("goes on from")
    (one, told), (other, told_again) = map(seen, (fresh, planned.target))
    assert told_again == told
    np.testing.assert_equal(other, one)
