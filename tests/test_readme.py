"""The README, the guide for contributors and the pages of the documentation against the code."""

import functools
import re
import shlex
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import h5py
import pytest
from packaging.version import Version
from pydantic import BaseModel

import rigidpend
from docs import generate
from rigidpend import cli, experiments
from rigidpend.config import catalogue
from rigidpend.config.schema import Number, Part
from rigidpend.render import captions
from rigidpend.render.report import DEPARTURES
from rigidpend.results import store
from rigidpend.runs import loading
from scripts import readme_tables

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
TEXTS = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in PAGES}


def blocks(language: str) -> list[tuple[str, str]]:
    """(page, content) of every block of code of a language."""
    mark = re.compile(rf"^```{language}\n(.*?)^```", re.MULTILINE | re.DOTALL)
    return [(page, block) for page, text in TEXTS.items() for block in mark.findall(text)]


def commands() -> list[list[str]]:
    """The arguments of every call of `rigidpend` in a block of shell commands."""
    found = []
    for _, block in blocks("sh"):
        for line in block.splitlines():
            words = shlex.split(line, comments=True)
            if words and Path(words[0]).name == "rigidpend":
                found.append(words[1 : words.index(">") if ">" in words else None])
    return found


@pytest.mark.parametrize("arguments", commands(), ids=" ".join)
def test_every_command_shown_is_understood(arguments: list[str], tmp_path: Path) -> None:
    """Its options exist, its configs do, and its settings fit them; nothing is run."""
    command = cli.command(arguments[0])
    given = command.make_context(arguments[0], arguments[1:]).params
    assert isinstance(command, click.Command)
    for name in given.get("names") or [given.get("name") or "fig4"]:
        path = "fig4" if str(name).endswith(".yaml") else str(name)
        loading.load_swept(catalogue.resolve((path,)), given.get("settings", ()))


def test_every_target_of_make_is_there_and_the_pages_show_commands() -> None:
    shown = re.findall(r"(?:^|`)make ([a-z-]+)", "\n".join(TEXTS.values()), re.MULTILINE)
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert set(shown) <= set(re.findall(r"^([a-z-]+):", makefile, re.MULTILINE))
    # A folder may have a blank in its name, and `make clean` removes.
    assert makefile.count("$(RESULTS)") == makefile.count('"$(RESULTS)"') > 10
    assert {arguments[0] for arguments in commands()} > {"run", "render", "describe", "verify"}


def test_make_attacks_runs_every_file_that_draws_by_lot() -> None:
    tried = re.findall(r"RIGIDPEND_SEED.*", (ROOT / "Makefile").read_text(encoding="utf-8"))[0]
    files = (path.relative_to(ROOT) for path in (ROOT / "tests").rglob("test_*.py"))
    drawing = {x for x in files if re.search(r"attacks(\.| import )lot", (ROOT / x).read_text())}
    assert {x.name for x in drawing} > {"test_signals.py", "test_faults.py", "test_files.py"}
    assert {x for x in drawing if x.parent.name != "attacks"} <= {*map(Path, tried.split())}


def test_the_example_in_python_has_the_shapes_that_are_said() -> None:
    [code] = [block for where, block in blocks("python") if where == "docs/python.md"]
    made: dict[str, Any] = {}
    exec(code, made)
    said = re.findall(r"^routes\.(\w+)  # (\([\d, ]+\))", code, re.MULTILINE)
    assert len(said) >= 2
    for name, shape in said:
        assert str(getattr(made["routes"], name).shape) == shape, name


def test_the_page_shows_all_of_a_stored_result() -> None:
    [shown] = re.findall(r"StoredResult\n.+\n +:members: (.+)\n +:undoc-", TEXTS["docs/python.md"])
    offered = {name for name in dir(rigidpend.StoredResult) if not name.startswith("_")}
    assert {*shown.split(", ")} == offered


def test_the_result_that_the_tour_reads_is_there(tmp_path: Path, monkeypatch: Any) -> None:
    [code] = [block for where, block in blocks("python") if where == "docs/tour.md"]
    (tmp_path / "results").symlink_to(ROOT / "results" / "reference")
    monkeypatch.chdir(tmp_path)
    exec(code, {})
    assert "theta2_0 = 1/10" in code
    with h5py.File("results/fig4.h5") as file:
        assert file["data/left/theta2_0"][1] == 0.1


@pytest.mark.parametrize("page", TEXTS)
def test_every_file_that_a_page_points_to_is_there(page: str) -> None:
    targets = re.findall(r"\]\(([^)#:]+)\)|\{figure\} (\S+)", TEXTS[page])
    for target in ("".join(either) for either in targets):
        assert ((ROOT / page).parent / target).exists(), target


def test_the_gallery_has_every_figure_once_with_what_one_sees_in_it() -> None:
    page = generate.gallery()
    shown = re.findall(r"\{figure\} \.\./results/gallery/(\S+)", page)
    assert sorted(shown) == sorted(x.name for x in (ROOT / "results/gallery").glob("*.png"))
    assert shown[:2] == ["fig1.png", "fig2.png"]
    for experiment in experiments.names():
        assert generate.plain(captions.caption(experiment)) in page
    # A benchmark has no body of its own.
    assert "\n`bench`\n" in page


def test_what_is_cited_is_the_last_release_and_what_comes_after_says_so() -> None:
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    [cited] = re.findall(r"^version: (.+)$", citation, re.MULTILINE)
    [date] = re.findall(r"^date-released: (.+)$", citation, re.MULTILINE)
    headings = re.findall(r"^## (.+)$", changes, re.MULTILINE)
    released = [line for line in headings if line != "Unreleased"]
    assert released[0] == f"{cited} - {date}"
    own = rigidpend.__version__
    assert (Version(own) > Version(cited) and Version(own).is_devrelease) == (headings != released)
    assert headings != released or own == cited


def test_what_an_index_shows_needs_no_checkout() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert not re.search(r"\]\(|<img", project["readme"]["text"])
    for words in re.findall(r"^ +rigidpend (.+?) *#", project["readme"]["text"], re.MULTILINE):
        name, *given = words.split()
        cli.command(name).make_context(name, given)
    assert {"authors", "classifiers", "license"} <= project.keys()
    # The notebooks are run by tests, and where the pages are built.
    extras = {name: set(needed) for name, needed in project["optional-dependencies"].items()}
    assert extras["notebook"] <= extras["docs"] & extras["test"]


@pytest.fixture(autouse=True, scope="module")
def _each_measurement_is_read_once() -> Iterator[None]:
    """To read one takes a second, and seven tests want them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(store, "load", functools.cache(store.load))
        yield


@pytest.mark.slow
@pytest.mark.parametrize("page", readme_tables.PAGES)
def test_the_tables_are_those_of_the_stored_measurement(page: str) -> None:
    assert (readme_tables.MEASURED / "bench.h5").is_file()
    text = TEXTS[page]
    assert readme_tables.renewed(page, text) == text
    for block in readme_tables.PAGES[page]:
        slipped = text.replace(f"<!-- {block} -->\n", f"<!-- {block} -->\nslip", 1)
        assert slipped != readme_tables.renewed(page, slipped) == text
        with pytest.raises(SystemExit, match=f"no block {block}"):
            readme_tables.renewed(page, text.replace(f"<!-- {block} -->", ""))


TIME = re.compile(r"(?<![\w.])\d[\d,.]* (?:s|ms|us|µs|ns|min|minutes|seconds|hours)\b")
"""A time that somebody measured."""
STATED = {
    "docs/experiments.md": "an example",
    "CONTRIBUTING.md": "the limit that marks a slow test",
}
"""Pages with times that are no measurements."""


def unsourced(text: str) -> list[str]:
    """Times of a page outside of what a command writes: blocks between marks, outputs; formulas."""
    written = r"<!-- (.+?) -->.*?<!-- /\1 -->|^```.*?^```|\$\$.*?\$\$"
    return TIME.findall(re.sub(written, "", text, flags=re.DOTALL | re.MULTILINE))


@pytest.mark.parametrize("page", [page for page in TEXTS if page not in STATED])
def test_every_time_on_a_page_is_written_by_a_command(page: str) -> None:
    assert unsourced(TEXTS[page]) == []
    assert unsourced(f"{TEXTS[page]}\nIt takes 4.2 s.\n") == ["4.2 s"]


NAMED = {"problem.bodies", "problem.arrays", "problem.cases", "problem.zooms"}
"""Sections whose keys are names of the user's choice."""


def keys_of(node: Any, place: str = "") -> Iterator[str]:
    """The keys of a config file, names of the user's choice as NAME."""
    for key, value in node.items():
        here = f"{place}{'NAME' if place[:-1] in NAMED else key}"
        yield here
        if isinstance(value, dict) and here != "problem.bodies.NAME":
            yield from keys_of(value, f"{here}.")


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(catalogue.known()))
def test_every_key_of_a_shipped_config_is_on_the_page(name: str) -> None:
    loaded = loading.load(catalogue.known()[name])
    told = {setting.key for setting in generate.keys(experiments.schema(loaded.content.experiment))}
    free = {f"{section}.NAME" for section in NAMED}
    asked = {key for key in keys_of(loaded.resolved()) if "." in key} - free
    by_name = ("problem.passages.columns.", "problem.passages.checked.")
    assert {key for key in asked if not key.startswith(by_name)} <= told
    assert len(asked) > 1


def test_a_key_is_told_with_type_default_and_meaning_with_its_unit() -> None:
    told = {setting.key: setting for setting in generate.keys(experiments.schema("route_codes"))}
    said = {key: (setting.kind, setting.default) for key, setting in told.items()}
    assert said["problem.n_symbols"] == ("whole number", "`15`")
    assert said["numerics.engine"] == ("`taylor` or `scipy`", "`auto`")
    assert said["numerics.precisions"][0] == "list of whole numbers"
    assert said["problem.arrays.NAME.step"][1] == "required"
    assert told["problem.arrays.NAME.step"].meaning.endswith(", radians.")
    assert told["problem.A"].meaning.startswith("Principal moments of inertia")


class Silent(Part):
    n: int = 1


class Bare(Part):
    x: Number
    """A number of no unit that anyone knows."""


@pytest.mark.parametrize(("part", "said"), [(Silent, "a meaning"), (Bare, "a unit")])
def test_a_key_without_meaning_or_unit_stops_the_build(part: type[BaseModel], said: str) -> None:
    with pytest.raises(ValueError, match=rf"readme\.{part.__name__}\..: .*without {said}"):
        list(generate.keys(part))


def test_every_command_is_there_with_its_options_and_examples() -> None:
    page = generate.commands()
    for name, command in ((name, cli.command(name)) for name in cli.COMMANDS):
        part = page.partition(f"\n## rigidpend {name}\n")[2].partition("\n## ")[0]
        for parameter in command.params:
            if isinstance(parameter, click.Option):
                assert all(option in part for option in parameter.opts), (name, parameter.opts)
        examples = (command.help or "").partition("Examples:\n")[2].splitlines()
        assert all(line.strip() in part for line in examples), name
    assert "\b" not in page


def test_every_departure_is_there() -> None:
    lines = generate.departures().splitlines()[2:]
    assert [line.replace("\\", "") for line in lines] == [
        f"| {' | '.join(departure)} |" for departure in DEPARTURES.rows
    ]
