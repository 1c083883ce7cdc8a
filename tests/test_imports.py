"""What imports what: a command nothing heavy before it needs it, no floor what is above it."""

import configparser
import json
from importlib.util import find_spec
from pathlib import Path

import pytest

import rigidpend
from docs import floors
from rigidpend.cli import COMMANDS
from scripts import readme_tables
from tests.config.samples import SMALL, changed, written
from tests.processes import python

ROOT = Path(__file__).resolve().parents[1]

HEAVY = {"numpy", "scipy", "h5py", "mpmath", "pydantic", "yaml", "matplotlib", "heyoka", "flint"}
HEAVY |= {"tqdm"}

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


def test_the_package_help_and_completion_import_nothing_heavy(tmp_path: Path) -> None:
    """One process does all in turn: whoever of them imports something is found by asking fewer."""
    helps = [f"rigidpend {words}" for words in ("--help", "--version")]
    helps += [f"rigidpend {name} --help" for name in COMMANDS]
    names = "complete run fig\ncomplete ru\ncomplete run fig4 --for"
    alone, helped, named = after_each(tmp_path, "\n".join(helps), names)
    assert {name for name in alone if name.startswith("rigidpend.")} == set()
    assert {f"rigidpend.cli.{name}" for name in ("run", "find", "measure")} <= helped
    assert (alone | helped | named) & HEAVY == set()


ENGINES = {"heyoka", "llvmlite", "scipy.integrate"}
ENGINES |= {f"rigidpend.orbits.integrate.{name}" for name in ("batch", "bigint", "dop853")}
COMPUTING = {"rigidpend.experiments.route_codes.compute", "rigidpend.routes.codes"}
COMPUTING |= {"rigidpend.mechanics.equations", "rigidpend.surfaces.melnikov"}


@pytest.mark.slow
def test_runs_import_one_engine_if_any_and_never_matplotlib_and_renders_nothing_that_computes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One process describes and computes, another draws without a display and finds all up to date.

    Doubles decide the small config: of the higher precisions that it allows nothing is imported.
    """
    monkeypatch.setenv("MPLBACKEND", "nonsense")
    written(tmp_path, changed("[53]", "[53, 106, 160]", SMALL), "small.yaml")
    words = "describe small.yaml", "run fig1 -j 1", "run small.yaml -j 1"
    _, described, closed, small = after_each(tmp_path, *(f"rigidpend {each}" for each in words))
    assert "h5py" not in described
    assert "rigidpend.mechanics.free_body" in closed
    assert closed & (ENGINES | {"matplotlib"}) == set()
    assert small & ENGINES == {"llvmlite", "rigidpend.orbits.integrate.batch"}
    assert "matplotlib" not in small
    lines = (f"rigidpend {word} small.yaml" for word in ("render", "run"))
    _, rendered, known = after_each(tmp_path, *lines)
    assert (tmp_path / "results" / "small.png").is_file()
    assert "matplotlib" in rendered
    assert "matplotlib.pyplot" not in rendered
    assert rendered & COMPUTING == set()
    assert {name for name in rendered if name.startswith("rigidpend.orbits.integrate")} == set()
    assert known - rendered > {"rigidpend.runs.runner"}
    assert known & ENGINES == set()


def test_the_public_names_are_there_without_being_asked_for_first() -> None:
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


def test_each_contract_is_of_modules_that_there_are() -> None:
    """import-linter takes a pattern without a module, or a foreign one that is none, for kept."""
    read = configparser.ConfigParser()
    read.read(ROOT / ".importlinter")
    for contract in map(read.__getitem__, read.sections()):
        for key in ("modules", "source_modules", "forbidden_modules"):
            for name in contract.get(key, "").split():
                place = name.replace(".", "/").replace("**", "*")
                there = any(ROOT.glob(place)) or any(ROOT.glob(f"{place}.py"))
                assert there or ("*" not in name and find_spec(name)), name


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
