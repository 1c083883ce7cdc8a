"""A run that goes on from kept parts writes the file that it would have written at once."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from rigidpend.runs import loading, runner
from rigidpend.runs.parts import Parts
from tests.config.samples import FIG4

TIMES = ("seconds", "created")
"""Attributes that tell times: of the run, and of the day."""


def seen(file: h5py.File) -> dict[str, Any]:
    """All objects of a file in their order, with all that can be told of them but the times."""
    found = {"/": attributes(file)}
    file.visititems(lambda name, node: found.update({name: features(node)}))
    return found


def features(node: Any) -> Any:
    if not isinstance(node, h5py.Dataset):
        return attributes(node), list(node)
    dims = [(each.label, [scale.name for scale in each.values()]) for each in node.dims]
    stored = str(node.dtype), node.shape, node.chunks, node.compression, node.fletcher32
    return attributes(node), dims, stored, np.asarray(node[()]).tobytes()


def attributes(node: Any) -> dict[str, Any]:
    # Those that refer to objects are told by the dimensions above.
    refer = ("DIMENSION_LIST", "REFERENCE_LIST")
    given = {name: None if name in refer else node.attrs[name] for name in node.attrs}
    return {name: repr(value) for name, value in given.items() if name not in TIMES}


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
    with h5py.File(fresh) as one, h5py.File(planned.target) as other:
        told = seen(one)
        assert seen(other) == told
        assert set(other["provenance"].attrs) == set(one["provenance"].attrs)
