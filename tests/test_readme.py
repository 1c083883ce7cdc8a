"""The README, the guide for contributors and the pages of the documentation against the code."""

from __future__ import annotations

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

import rigidpend
from docs import generate
from rigidpend import cli, experiments
from rigidpend.config import catalogue
from rigidpend.render import captions
from rigidpend.results import store
from rigidpend.runs import loading
from scripts import lowest, readme_tables, times

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
        loading.load_all(catalogue.resolve((path,)), given.get("settings", ()))


def test_every_target_of_make_is_there_and_the_pages_show_commands() -> None:
    shown = re.findall(r"(?:^|`)make ([a-z-]+)", "\n".join(TEXTS.values()), re.MULTILINE)
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert set(shown) <= set(re.findall(r"^([a-z-]+):", makefile, re.MULTILINE))
    # A folder may have a blank in its name, and `make clean` removes.
    assert makefile.count("$(RESULTS)") == makefile.count('"$(RESULTS)"') > 10
    assert {arguments[0] for arguments in commands()} > {"run", "render", "describe", "verify"}


def test_the_example_in_python_has_the_shapes_that_are_said() -> None:
    [code] = [block for where, block in blocks("python") if where == "docs/python.md"]
    made: dict[str, Any] = {}
    exec(code, made)
    said = re.findall(r"^routes\.(\w+)  # (\([\d, ]+\))", code, re.MULTILINE)
    assert len(said) >= 2
    for name, shape in said:
        assert str(getattr(made["routes"], name).shape) == shape, name


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


def test_the_lowest_versions_are_those_that_the_project_names() -> None:
    named = lowest.lowest('[project]\ndependencies = ["numpy>=2.0", "heyoka>=7.1,<8; x == \'y\'"]')
    assert named == ["numpy==2.0", "heyoka==7.1"]
    with pytest.raises(ValueError, match="'click<9' names no lowest version"):
        lowest.lowest('[project]\ndependencies = ["click<9"]')


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
    assert readme_tables.renewed(page, TEXTS[page]) == TEXTS[page]


@pytest.mark.slow
@pytest.mark.parametrize(("page", "block"), [("README.md", "speed"), ("docs/measured.md", "bench")])
def test_a_figure_that_is_not_the_measured_one_is_noticed(page: str, block: str) -> None:
    text = TEXTS[page]
    shown = text.partition(f"<!-- {block} -->")[2].partition(f"<!-- /{block} -->")[0]
    number = re.search(r"\d(\.\d+)? [mu]s", shown)
    assert number
    slipped = text.replace(number[0], f"9{number[0]}", 1)
    assert slipped != readme_tables.renewed(page, slipped) == text
    with pytest.raises(SystemExit, match=f"no block {block}"):
        readme_tables.renewed(page, text.replace(f"<!-- {block} -->", ""))


def test_the_readme_is_two_screens_with_a_picture_first_and_two_commands() -> None:
    text = TEXTS["README.md"]
    lines = text.splitlines()
    assert len(lines) <= 80
    assert lines[2].startswith("![")
    [shown] = [block for page, block in blocks("sh") if page == "README.md"]
    assert [line.partition("#")[0].strip() for line in shown.splitlines()] == [
        "make figures",
        "make test",
    ]
    assert all(f"\n## {head}\n" in text for head in ("How it compares", "Cite"))


TIME = re.compile(r"(?<![\w.])\d[\d,.]* (?:s|ms|us|µs|ns|min|minutes|seconds|hours)\b")
"""A time that somebody measured."""
STATED = {
    "docs/experiments.md": "an example",
    "CONTRIBUTING.md": "the limit that marks a slow test",
}
"""Pages with times that are no measurements."""


def test_every_table_of_times_is_filled() -> None:
    for block, (page, _) in times.BLOCKS.items():
        shown = TEXTS[page].partition(f"<!-- {block} -->")[2].partition(f"<!-- /{block} -->")[0]
        assert "\nTime of processors; " in shown, block


def unsourced(text: str) -> list[str]:
    """Times of a page outside of what a command writes: blocks between marks, outputs; formulas."""
    written = r"<!-- (.+?) -->.*?<!-- /\1 -->|^```.*?^```|\$\$.*?\$\$"
    return TIME.findall(re.sub(written, "", text, flags=re.DOTALL | re.MULTILINE))


@pytest.mark.parametrize("page", [page for page in TEXTS if page not in STATED])
def test_every_time_on_a_page_is_written_by_a_command(page: str) -> None:
    assert unsourced(TEXTS[page]) == []
    assert unsourced(f"{TEXTS[page]}\nIt takes 4.2 s.\n") == ["4.2 s"]
