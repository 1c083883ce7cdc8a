"""Images that are up to date are kept; whatever they depend on makes them be drawn anew."""

from __future__ import annotations

import re
import shutil
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest

from rigidpend import render
from rigidpend.cli import main
from rigidpend.render import report
from rigidpend.results import store
from rigidpend.runs import certificate_files
from tests.cli.calls import REFERENCE


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A result whose images are coarse, to be drawn sooner."""
    monkeypatch.setattr(render, "PIXELS", 300)
    return Path(shutil.copy(REFERENCE / "fig2.h5", tmp_path / "fig2.h5"))


def test_an_image_is_drawn_once_and_again_where_it_is_half_or_that_is_asked_for(
    source: Path,
) -> None:
    target = source.with_suffix(".png")
    assert render.render([source], target)
    first = target.read_bytes()
    target.write_bytes(first + first[-12:])
    assert not render.render([source], target)
    assert render.render([source], target, force=True)
    assert target.read_bytes() == first
    target.write_bytes(first[:-7])
    assert render.render([source], target)


def other_result(source: Path, patch: Any) -> None:
    """Other bytes that the same code draws."""
    known = store.attributes(source)
    patch.setattr(store, "attributes", lambda path: known)
    shutil.copy(REFERENCE / "fig1.h5", source)


def a_certificate(source: Path, patch: Any) -> None:
    certificate_files.certificate_of(source).write_bytes(b"any")


def other_code(source: Path, patch: Any) -> None:
    patch.setattr(render, "code_hash_of", lambda *files: "0")


def other_style(source: Path, patch: Any) -> None:
    style = source.with_name("other.mplstyle")
    style.write_text(render.STYLE.read_text() + "font.size: 11\n")
    patch.setattr(render, "STYLE", style)


def other_library(source: Path, patch: Any) -> None:
    known = metadata.version
    other = {"matplotlib": "0"}
    patch.setattr(metadata, "version", lambda name: other.get(name) or known(name))


@pytest.mark.parametrize(
    "change", [other_result, a_certificate, other_code, other_style, other_library]
)
def test_the_fingerprint_has_all_that_an_image_depends_on(
    source: Path, monkeypatch: pytest.MonkeyPatch, change: Any
) -> None:
    before = render.drawn_from([source])
    assert render.drawn_from([source]) == before
    change(source, monkeypatch)
    assert render.drawn_from([source]) != before


def test_the_code_of_a_drawing_and_the_order_of_several_results_are_in_it(
    source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = Path(shutil.copy(REFERENCE / "fig1.h5", source.with_name("fig1.h5")))
    assert len({render.drawn_from(x) for x in ([source], [source, other], [other, source])}) == 3
    hashed: set[str] = set()

    def noted(*files: Path) -> str:
        hashed.update(each.name for each in files)
        return ""

    monkeypatch.setattr(render, "code_hash_of", noted)
    render.drawn_from([source])
    assert hashed == {"draw.py", "__init__.py", "captions.py"}


def test_the_report_takes_the_image_that_is_there(
    source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    render.render([source], source.with_suffix(".png"))
    drawn = re.findall('data:image[^"]*', report.build([source]).html)
    monkeypatch.setattr(render, "image", None)
    assert re.findall('data:image[^"]*', report.build([source]).html) == drawn


def test_the_command_says_what_it_kept(
    source: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(source.parent)
    for options, said in (((), "drawn"), ((), "up to date"), (("--force",), "drawn")):
        main.main(["render", "fig2.h5", *options], standalone_mode=False)
        assert f"fig2.png {said}" in "".join(capsys.readouterr())
