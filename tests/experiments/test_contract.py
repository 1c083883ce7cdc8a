"""The contract of experiments: every folder keeps it, as mypy sees it."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rigidpend import experiments
from rigidpend.experiments.data.layout import (
    FLAG,
    FLOAT,
    NUMBER,
    TEXT,
    WHOLE,
    Field,
    Layout,
)

ROOT = Path(__file__).resolve().parents[2]
NAMES = experiments.names()

SEAM = """
from rigidpend.config.schema import ExperimentConfig
from rigidpend.experiments.contract import Computation, Drawing, Reporting
from rigidpend.experiments.data.layout import Layout
from rigidpend.experiments.{name} import compute, draw, layout
from rigidpend.experiments.{name}.schema import Config

schema: type[ExperimentConfig] = Config
computation: Computation[Config] = compute
declared: Layout = layout.LAYOUT
drawing: Drawing = draw
"""
REPORT = """
from rigidpend.experiments.{name} import report

reporting: Reporting = report
"""


def seam(name: str) -> str:
    """Assignments that only type-check where an experiment keeps the contract."""
    has_report = (experiments.FOLDER / name / "report.py").is_file()
    return (SEAM + REPORT if has_report else SEAM).format(name=name)


WRONG = {
    "of_another_config": ("route_codes.schema", "precession.schema", "ncompatible type"),
    "without_a_drawing": ("drawing: Drawing = draw", "drawing: Drawing = layout", '"Drawing"'),
}
"""Slips in the seam of an experiment: what stands for what, and of what mypy complains."""


@pytest.mark.slow
def test_every_experiment_keeps_the_contract_and_with_a_slip_none_does(tmp_path: Path) -> None:
    sources = {f"seam_{name}": seam(name) for name in NAMES}
    sources |= {name: seam("route_codes").replace(*slip[:2]) for name, slip in WRONG.items()}
    for name, source in sources.items():
        (tmp_path / f"{name}.py").write_text(source, encoding="utf-8")
    # In a process of its own: the much memory that it takes would be kept by this one.
    command = [sys.executable, "-m", "mypy", "--config-file", str(ROOT / "pyproject.toml")]
    done = subprocess.run(
        [*command, *(str(tmp_path / f"{name}.py") for name in sources)],
        env={**os.environ, "MYPYPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert not done.stderr
    assert "seam_" not in done.stdout
    for name, (*_, complaint) in WRONG.items():
        lines = [line for line in done.stdout.splitlines() if f"{name}.py" in line]
        assert any(complaint in line for line in lines), done.stdout


def imported(file: Path) -> Iterator[str]:
    """The modules that a file imports when it runs, by full name."""
    waiting: list[ast.AST] = [ast.parse(file.read_bytes())]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        waiting += ast.iter_child_nodes(node)


@pytest.mark.parametrize("name", NAMES)
def test_a_layout_is_plain_data_for_which_nothing_heavy_is_imported(name: str) -> None:
    file = experiments.FOLDER / name / "layout.py"
    allowed = (
        "rigidpend.experiments.data",
        "rigidpend.experiments.route_layout",
        "rigidpend.experiments.weight_series",
    )
    ours = [module for module in imported(file) if module.partition(".")[0] == "rigidpend"]
    assert all(module.startswith(allowed) for module in ours), ours
    others = {module.partition(".")[0] for module in imported(file)} - {"rigidpend"}
    assert others <= {"numpy", *sys.stdlib_module_names}
    declared = dict(fields(experiments.layout(name)))
    assert declared
    for field, node in declared.items():
        assert node.kind in {FLOAT, WHOLE, FLAG, TEXT, NUMBER}
        if field not in OWN.get(name, ()):
            assert node.description, field
            assert node.units or node.kind == TEXT, field


OWN = {"stress": ("value", "bound", "up_to"), "bench": ("A1", "A2", "A3", "mu", "h0")}
"""Fields whose unit, or meaning, each claim has for itself, or each body."""


def fields(layout: Layout) -> Iterator[tuple[str, Field]]:
    """All fields of a layout by name, in groups too."""
    for name, node in layout.items():
        assert name.strip("<>?").replace(" ", "_").isidentifier(), name
        if isinstance(node, Field):
            yield name.strip("?"), node
        else:
            yield from fields(node)


@pytest.mark.parametrize("name", ["nonesuch", "..run", "route_codes.compute", ""])
def test_a_name_from_a_file_imports_no_other_module(name: str) -> None:
    for part in (experiments.schema, experiments.computation, experiments.drawing):
        with pytest.raises(experiments.UnknownExperiment, match="no such experiment"):
            part(name)
