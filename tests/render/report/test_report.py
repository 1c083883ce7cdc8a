"""The report: complete, self-contained, safe, and the paper's numbers beside the file's."""

from __future__ import annotations

import html.parser
import shutil
from pathlib import Path
from typing import Any

import h5py
import pytest

from rigidpend import render
from rigidpend.experiments.asymptotic_surfaces import report as asymptotic_surfaces
from rigidpend.experiments.herpolhodes import report as herpolhodes
from rigidpend.experiments.route_codes import report as route_codes
from rigidpend.render import report
from rigidpend.render.report import page
from rigidpend.render.report.departures import DEPARTURES
from rigidpend.results import store
from rigidpend.runs.certificate_files import is_certificate

REFERENCE = Path(__file__).resolve().parents[3] / "results" / "reference"
SMALL = ("fig2", "fig4", "fig5")
VOID = {"meta", "img", "br"}


class Parsed(html.parser.HTMLParser):
    """Tags with their attributes, text, and whether every tag is closed in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("results")
    for name in SMALL:
        shutil.copyfile(REFERENCE / f"{name}.h5", made / f"{name}.h5")
    return made


@pytest.fixture(scope="module")
def text(folder: Path) -> str:
    return report.build(report.results(folder)).html


@pytest.fixture(scope="module")
def parsed(text: str) -> Parsed:
    return Parsed(text)


@pytest.mark.slow
def test_every_result_has_a_section_with_its_figure_and_provenance(parsed: Parsed) -> None:
    ids = [attributes.get("id") for tag, attributes in parsed.tags if tag == "section"]
    assert ids == [*SMALL, "departures"]
    pictures = [attributes for tag, attributes in parsed.tags if tag == "img"]
    assert len(pictures) == len(SMALL)
    assert all(str(a["src"]).startswith("data:image/png;base64,iVBOR") for a in pictures)
    assert all(a["alt"] for a in pictures)
    words = " ".join(parsed.words)
    for name in SMALL:
        stored = store.attributes(REFERENCE / f"{name}.h5")
        assert stored["config_hash"] in words
        assert stored["code_hash"] in words


@pytest.mark.slow
def test_the_page_is_well_formed_and_needs_nothing_else(parsed: Parsed, text: str) -> None:
    assert parsed.open == []
    assert {tag for tag, _ in parsed.tags} & {"script", "link", "iframe", "object"} == set()
    for _, attributes in parsed.tags:
        for name in ("src", "href"):
            assert str(attributes.get(name, "#")).startswith(("#", "data:"))
    assert "@import" not in text
    assert "url(" not in text


def test_every_departure_is_in_the_page() -> None:
    parsed = Parsed(page.html((), DEPARTURES))
    for departure in DEPARTURES:
        assert set(departure) <= set(parsed.words)


@pytest.mark.slow
def test_what_results_say_of_themselves_is_text_not_markup(tmp_path: Path) -> None:
    path = tmp_path / "fig2.h5"
    shutil.copyfile(REFERENCE / "fig2.h5", path)
    result = store.load(path)
    result["attributes"]["name"] = "<script>alert(1)</script>"
    result["provenance"]["system"] = "<b>bold</b>"
    found = Parsed(page.html([report.section(result)], ()))
    assert {tag for tag, _ in found.tags} & {"script", "b"} == set()
    assert "<b>bold</b>" in found.words


def test_table_1_is_the_paper_s_beside_the_file_s() -> None:
    result = store.load(REFERENCE / "fig3.h5")
    [table] = asymptotic_surfaces.tables(result)
    for row in table.rows:
        assert float(row[1]) == pytest.approx(float(row[2]), abs=5.1e-6)
        assert float(row[3]) == pytest.approx(float(row[4]), abs=5.1e-6)
    with h5py.File(REFERENCE / "fig3.h5") as file:
        alpha0 = file["data/table/alpha0"][:]
    assert [row[2] for row in table.rows] == [f"{x:.7f}" for x in alpha0]


def test_the_routes_are_the_paper_s_beside_the_file_s(folder: Path) -> None:
    routes, plateaus = herpolhodes.tables(store.load(folder / "fig5.h5"))
    assert [row[1] for row in routes.rows] == list(herpolhodes.ROUTES.values())
    assert [row[2] for row in routes.rows] == [row[1] for row in routes.rows]
    assert {row[3] for row in plateaus.rows} == {herpolhodes.INCREMENT}


def test_the_counts_of_symbols_are_the_file_s(folder: Path) -> None:
    [table] = route_codes.tables(store.load(folder / "fig4.h5"))
    assert [row[:4] for row in table.rows] == [
        ("left", "63", "945", "945"),
        ("right", "32", "480", "480"),
    ]


def test_other_bodies_have_no_printed_numbers_beside_them() -> None:
    result = store.load(REFERENCE / "fig3.h5")
    table = result["data"]["table"]
    for name in table:
        table[name] = table[name][:1]
    bodies = result["data"]["bodies"]
    result["data"]["bodies"] = {"a": bodies["a"]}
    [found] = asymptotic_surfaces.tables(result)
    assert [row[1] for row in found.rows] == [""]


def test_a_folder_without_results_is_said_with_the_mend(tmp_path: Path) -> None:
    with pytest.raises(store.StoreError, match="no results; call: rigidpend run all"):
        report.build(report.results(tmp_path))


def test_a_page_that_cannot_be_built_leaves_the_old_one(tmp_path: Path) -> None:
    target = tmp_path / "report.html"
    target.write_text("old")
    (tmp_path / "fig1.h5").write_bytes(b"no HDF5")
    with pytest.raises(store.StoreError):
        report.write(report.results(tmp_path), target)
    assert target.read_text() == "old"


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts of the page have no pictures."""
    monkeypatch.setattr(render, "image", lambda *_: b"")
    monkeypatch.setattr(report, "picture", lambda _: "")


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_every_experiment_has_a_caption_and_numbers() -> None:
    for path in sorted(REFERENCE.glob("*.h5")):
        if is_certificate(path):
            continue
        found = report.section(store.load(path))
        assert found.caption.endswith(".")
        assert found.tables, path
        assert all(table.rows for table in found.tables)
        said = " ".join(found.bodies)
        assert "A = (2, " in said, path


@pytest.mark.slow
def test_pictures_take_little_room_in_the_page() -> None:
    """Fig. 3 is the largest: shaded surfaces, 4 MB with all their colours."""
    found = report.section(store.load(REFERENCE / "fig3.h5"))
    assert 20_000 < len(found.picture) < 1_200_000


@pytest.mark.usefixtures("undrawn")
def test_numbers_printed_for_one_body_do_not_stand_beside_another(folder: Path) -> None:
    result = store.load(folder / "fig5.h5")
    result["attributes"]["figure"] = ""
    routes, plateaus = herpolhodes.tables(result)
    assert {row[1] for row in routes.rows} == {row[2] for row in plateaus.rows} == {""}
    assert report.section(result).title == "Herpolhodes: fig5"


@pytest.mark.slow
def test_one_bad_file_is_a_section_with_its_reason(folder: Path, tmp_path: Path) -> None:
    shutil.copyfile(folder / "fig2.h5", tmp_path / "good.h5")
    (tmp_path / "bad.h5").write_bytes(b"no HDF5")
    (tmp_path / "folder.h5").mkdir()
    made = report.build(report.results(tmp_path))
    assert len(made.problems) == 2
    assert made.html.count('class="problem"') == 2
    assert made.html.count("<img") == 1


def test_a_certificate_that_cannot_be_read_is_a_sentence_beside_its_result(
    folder: Path, tmp_path: Path
) -> None:
    shutil.copyfile(folder / "fig5.h5", tmp_path / "fig5.h5")
    (tmp_path / "fig5.certificate.h5").write_bytes(b"none")
    found = report.build(report.results(tmp_path))
    [said] = found.problems
    assert said.startswith("nothing is marked as proven: ")
    assert said in " ".join(Parsed(found.html).words)
    assert found.html.count("<img ") == 1
