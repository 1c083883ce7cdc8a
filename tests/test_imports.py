"""What a command imports: nothing heavy before it is needed, no drawing in a run, and so on."""

from __future__ import annotations

from pathlib import Path

import pytest

from rigidpend.cli import COMMANDS
from rigidpend.orbits.integrate.arithmetic import default_engine
from tests.config.samples import SMALL, changed, written
from tests.processes import modules

HEAVY = {"numpy", "scipy", "h5py", "mpmath", "pydantic", "yaml", "matplotlib", "heyoka", "flint"}

COMMAND = """
import json, sys
from rigidpend.cli import main
try:
    main(json.loads(sys.argv[1]), prog_name="rigidpend")
except SystemExit as end:
    assert not end.code, end.code
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A working directory with a small config; its result is there after the first run.

    Doubles decide it: of the higher precisions that it allows nothing is to be imported.
    """
    made = tmp_path_factory.mktemp("imports")
    written(made, changed("[53]", "[53, 106, 160]", SMALL), "small.yaml")
    return made


@pytest.fixture(scope="module")
def by_run(folder: Path) -> set[str]:
    """The modules that a first run imports."""
    return modules(COMMAND, folder, "run", "small.yaml", "-j", "1")


@pytest.fixture(scope="module")
def by_second_run(folder: Path, by_run: set[str]) -> set[str]:
    """The modules that a run imports of which the result is up to date."""
    return modules(COMMAND, folder, "run", "small.yaml")


def test_the_package_alone_imports_nothing_heavy(tmp_path: Path) -> None:
    found = modules("import rigidpend", tmp_path)
    assert found & HEAVY == set()
    assert {name for name in found if name.startswith("rigidpend.")} == set()


HELP = """
import sys
from rigidpend.cli import main
for line in (*LINES, "--help", "--version", "completion zsh"):
    try:
        main(line.split(), prog_name="rigidpend")
    except SystemExit as end:
        assert not end.code, (line, end.code)
"""
COMPLETION = """
import json, sys
from click.shell_completion import ShellComplete
from rigidpend.cli import main
for line in json.loads(sys.argv[1]):
    *before, last = line.split(" ")
    offered = ShellComplete(main, {}, "rigidpend", "X").get_completions(before, last)
    assert offered, line
"""


def test_help_and_completion_of_names_import_nothing_heavy(tmp_path: Path) -> None:
    """One process asks for all: whoever of them imports something is found by asking fewer."""
    helps = [f"{name} --help" for name in COMMANDS]
    found = modules(HELP.replace("LINES", repr(helps)), tmp_path)
    assert {f"rigidpend.cli.{name}" for name in ("run", "find", "measure")} <= found
    assert found & HEAVY == set()
    assert modules(COMPLETION, tmp_path, "run fig", "ru", "run fig4 --for") & HEAVY == set()


def test_completion_of_keys_imports_nothing_that_computes(tmp_path: Path) -> None:
    found = modules(COMPLETION, tmp_path, "run fig4 --set problem.")
    assert found & (HEAVY - {"yaml", "pydantic"}) == set()


@pytest.mark.slow
def test_a_run_never_imports_matplotlib(by_run: set[str], by_second_run: set[str]) -> None:
    assert "rigidpend.runs.runner" in by_run & by_second_run
    assert "matplotlib" not in by_run | by_second_run


@pytest.mark.slow
def test_an_engine_is_imported_when_it_computes_and_not_before(
    by_run: set[str], by_second_run: set[str]
) -> None:
    engine = {
        "taylor": "rigidpend.orbits.integrate.batch",
        "scipy": "rigidpend.orbits.integrate.dop853",
    }
    assert engine[default_engine()] in by_run
    others = {"heyoka", "llvmlite", "scipy.integrate", "rigidpend.orbits.integrate.bigint"}
    engines = {*others, *engine.values()}
    assert by_second_run & engines == set()


@pytest.mark.slow
def test_a_run_imports_one_engine_only(by_run: set[str]) -> None:
    needed = {"taylor": "llvmlite", "scipy": "scipy.integrate"}[default_engine()]
    assert by_run & {"heyoka", "llvmlite", "scipy.integrate"} == {needed}


@pytest.mark.slow
def test_render_imports_nothing_that_computes_and_no_display(
    folder: Path, by_run: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MPLBACKEND", "nonsense")
    found = modules(COMMAND, folder, "render", "small.yaml")
    assert (folder / "results" / "small.png").is_file()
    assert "matplotlib" in found
    assert "matplotlib.pyplot" not in found
    computing = {
        "heyoka",
        "scipy.integrate",
        "rigidpend.routes.codes",
        "rigidpend.mechanics.equations",
    }
    computing |= {"rigidpend.experiments.route_codes.compute", "rigidpend.surfaces.melnikov"}
    assert found & computing == set()
    assert {name for name in found if name.startswith("rigidpend.orbits.integrate")} == set()


@pytest.mark.slow
@pytest.mark.parametrize("command", [("list",), ("describe", "small.yaml")])
def test_what_shows_imports_no_engine_and_no_drawing(
    folder: Path, command: tuple[str, ...]
) -> None:
    found = modules(COMMAND, folder, *command)
    assert found & {"heyoka", "scipy.integrate", "matplotlib"} == set()
    assert "h5py" not in found or command == ("list",)


def test_the_public_names_are_there_without_being_asked_for_first() -> None:
    import rigidpend

    assert set(rigidpend.__all__) <= set(dir(rigidpend))
    assert all(callable(getattr(rigidpend, name)) for name in rigidpend.__all__)
    with pytest.raises(AttributeError, match="module 'rigidpend' has no attribute 'bodies'"):
        _ = rigidpend.bodies
