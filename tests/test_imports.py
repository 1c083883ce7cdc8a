"""What a command imports: nothing heavy before it is needed, no drawing in a run, and so on."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rigidpend.cli import COMMANDS
from tests.config.samples import SMALL, changed, written
from tests.processes import python

HEAVY = {"numpy", "scipy", "h5py", "mpmath", "pydantic", "yaml", "matplotlib", "heyoka", "flint"}

DO = """
import json, sys
import rigidpend
print("modules", *sys.modules)
from click.shell_completion import ShellComplete
from rigidpend.cli import main
for lines in json.loads(sys.argv[1]):
    for program, *words in map(str.split, lines.splitlines()):
        if program == "complete":
            *before, last = words
            assert ShellComplete(main, {}, "rigidpend", "X").get_completions(before, last), words
            continue
        try:
            main(words, prog_name="rigidpend")
        except SystemExit as end:
            assert not end.code, (words, end.code)
    print("modules", *sys.modules)
"""


def after_each(folder: Path, *lines: str) -> list[set[str]]:
    """The modules that a process has imported with the package, and after each of some lines."""
    done = python(folder, "-c", DO, json.dumps(lines))
    assert done.returncode == 0, done.stderr
    told = (line.split() for line in done.stdout.splitlines())
    return [set(words[1:]) for words in told if words[:1] == ["modules"]]


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
    return after_each(folder, "rigidpend run small.yaml -j 1")[-1]


def test_the_package_help_and_completion_import_nothing_heavy(tmp_path: Path) -> None:
    """One process does all in turn: whoever of them imports something is found by asking fewer."""
    helps = [f"rigidpend {words}" for words in ("--help", "--version")]
    helps += [f"rigidpend {name} --help" for name in COMMANDS]
    names = "complete run fig\ncomplete ru\ncomplete run fig4 --for"
    alone, helped, named = after_each(tmp_path, "\n".join(helps), names)
    assert {name for name in alone if name.startswith("rigidpend.")} == set()
    assert {f"rigidpend.cli.{name}" for name in ("run", "find", "measure")} <= helped
    assert (alone | helped | named) & HEAVY == set()


@pytest.mark.slow
def test_a_run_imports_one_engine_and_never_matplotlib(by_run: set[str]) -> None:
    assert "rigidpend.runs.runner" in by_run
    assert "matplotlib" not in by_run
    assert "rigidpend.orbits.integrate.batch" in by_run
    assert by_run & {"heyoka", "llvmlite", "scipy.integrate"} == {"llvmlite"}


@pytest.mark.slow
def test_what_has_a_closed_form_is_computed_without_an_integrator(tmp_path: Path) -> None:
    found = after_each(tmp_path, "rigidpend run fig1 -j 1")[-1]
    assert "rigidpend.mechanics.free_body" in found
    assert found & {"heyoka", "llvmlite", "matplotlib", "scipy.integrate"} == set()


@pytest.mark.slow
def test_what_shows_and_a_run_of_what_is_up_to_date_import_no_engine_and_no_drawing(
    folder: Path, by_run: set[str]
) -> None:
    lines = (f"rigidpend {words}" for words in ("describe small.yaml", "list", "run small.yaml"))
    _, described, _, found = after_each(folder, *lines)
    assert "h5py" not in described
    assert "rigidpend.runs.runner" in found
    engines = {"heyoka", "llvmlite", "scipy.integrate", "rigidpend.orbits.integrate.bigint"}
    engines |= {f"rigidpend.orbits.integrate.{name}" for name in ("batch", "dop853")}
    assert found & (engines | {"matplotlib"}) == set()


@pytest.mark.slow
def test_render_imports_nothing_that_computes_and_no_display(
    folder: Path, by_run: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MPLBACKEND", "nonsense")
    found = after_each(folder, "rigidpend render small.yaml")[-1]
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


def test_the_public_names_are_there_without_being_asked_for_first() -> None:
    import rigidpend

    assert set(rigidpend.__all__) <= set(dir(rigidpend))
    assert all(callable(getattr(rigidpend, name)) for name in rigidpend.__all__)
    with pytest.raises(AttributeError, match="module 'rigidpend' has no attribute 'bodies'"):
        _ = rigidpend.bodies


@pytest.mark.slow
def test_no_plugin_of_another_package_is_loaded_to_check_a_config(tmp_path: Path) -> None:
    named = tmp_path / "intruder-1.dist-info"
    named.mkdir()
    (named / "METADATA").write_text("Metadata-Version: 2.1\nName: intruder\nVersion: 1\n")
    (named / "entry_points.txt").write_text("[pydantic]\nany = intruder:plugin\n")
    (tmp_path / "intruder.py").write_text("print('intruded')\nplugin = None\n")
    path = written(tmp_path, SMALL, "small.yaml")
    done = python(tmp_path, "-m", "rigidpend", "run", path.name, "-n")
    assert "would compute" in done.stderr, done.stderr
    assert "intruded" not in done.stdout
