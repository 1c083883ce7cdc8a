"""The floors of the house: the linter of imports sees what it is there for; the pages show them."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import rigidpend
from docs import floors
from scripts import readme_tables

ROOT = Path(__file__).resolve().parents[1]

SLIPS = {
    "Floors": ("mechanics/jacobi.py", "from rigidpend.orbits import integrate"),
    "Circles": ("mechanics/free_body.py", "from rigidpend.mechanics import in_space"),
    "what checks a proof": (
        "routes/certified/checker.py",
        "import rigidpend.routes.certified.codes",
    ),
    "what draws": ("experiments/route_codes/draw.py", "from rigidpend.surfaces import melnikov"),
    "what computes": ("orbits/integrate/batch.py", "import matplotlib"),
    "none imports another": (
        "experiments/route_map/compute.py",
        "from rigidpend.experiments.route_codes import compute",
    ),
    "llvmlite": ("orbits/return_map/kernel.py", "import llvmlite.binding"),
    "python-flint": ("mechanics/equations.py", "import flint"),
    "Dask": ("runs/runner.py", "import distributed"),
    "h5py": ("runs/runner.py", "import h5py"),
    "heyoka": ("routes/codes.py", "import heyoka"),
    "matplotlib is": ("results/store.py", "import matplotlib"),
    "Route codes": ("routes/codes.py", "from rigidpend.routes.symbolic import find"),
    "Orbits": ("orbits/integrate/batch.py", "from rigidpend.orbits import return_map"),
}
"""Of each contract a part of its name, and a line that breaks it, late in a function."""


@pytest.mark.slow
def test_the_linter_sees_a_slip_in_every_contract(tmp_path: Path) -> None:
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "rigidpend", tmp_path / "rigidpend", ignore=ignored)
    shutil.copy(ROOT / ".importlinter", tmp_path)
    for place, line in SLIPS.values():
        with (tmp_path / "rigidpend" / place).open("a") as file:
            file.write(f"\n\ndef slip() -> None:\n    {line}\n")
    done = subprocess.run(
        [str(Path(sys.executable).with_name("lint-imports")), "--no-logo", "--no-cache"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path), "COLUMNS": "200"},
        capture_output=True,
        text=True,
        check=False,
    )
    said = done.stdout.partition("Contracts:")[0]
    broken = [line for line in said.splitlines() if " BROKEN" in line]
    assert (done.returncode, len(broken), " KEPT" in said) == (1, len(SLIPS), False), said
    assert all(any(name in line for line in broken) for name in SLIPS)


def test_the_floors_are_the_folders_and_stand_in_the_docstring_and_in_the_guide() -> None:
    order = [x for floor in floors.floors() for x in floor if (floors.PACKAGE / x).is_dir()]
    told = (rigidpend.__doc__ or "").partition("Folders\n-------")[2].partition("Words\n-----")[0]
    lines = [line for line in told.splitlines() if line[:1].isalpha() and "/ " in line]
    assert [line.split("/")[0] for line in lines] == order
    names = {path.name for path in floors.PACKAGE.iterdir()} - {"__pycache__", "py.typed"}
    assert names == {"__init__.py", "__main__.py", "notebook.py", *order}
    assert len(names) <= 15
    text = (ROOT / readme_tables.HOUSE).read_text(encoding="utf-8")
    assert readme_tables.renewed(readme_tables.HOUSE, text) == text
