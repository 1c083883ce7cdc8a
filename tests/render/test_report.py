"""The report: complete, self-contained, safe, and the paper's numbers beside the file's."""

import re
import shutil
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from rigidpend import experiments, render
from rigidpend.experiments.asymptotic_surfaces import draw as asymptotic_surfaces
from rigidpend.experiments.herpolhodes import draw as herpolhodes
from rigidpend.machine import files
from rigidpend.machine.wording import Table
from rigidpend.render import captions, report
from rigidpend.render.report import DEPARTURES
from rigidpend.results import store
from tests.cli.calls import REFERENCE
from tests.experiments.trees import reference, shared_reference

SMALL = ("fig2", "fig4", "exponents")
"""Figures of the paper come first, in their order."""


def parsed(page: str) -> ElementTree.Element:
    """The page, of which every tag is closed in order but those that HTML has without an end."""
    closed = re.sub(r"<((?:meta|img|br)\b[^>]*)>", r"<\1/>", page)
    return ElementTree.fromstring(closed.replace("<!doctype html>", ""))


def words(page: str) -> list[str]:
    """The texts of a page."""
    return [x.strip() for x in parsed(page).itertext()]


@pytest.mark.slow
def test_the_page_has_every_result_is_well_formed_and_needs_nothing_else(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    picture = (REFERENCE.parent / "gallery" / "fig4.png").read_bytes()
    monkeypatch.setattr(render, "image", lambda *_: picture)
    text, problems = report.build([REFERENCE / f"{name}.h5" for name in reversed(SMALL)])
    assert problems == []
    page = parsed(text)
    assert [x.get("id") for x in page.iter("section")] == [*SMALL, "departures"]
    pictures = list(page.iter("img"))
    assert len(pictures) == len(SMALL)
    assert all(x.attrib["src"].startswith("data:image/png;base64,iVBOR") for x in pictures)
    assert all(x.attrib["alt"] for x in pictures)
    for name in SMALL:
        stored = store.attributes(REFERENCE / f"{name}.h5")
        assert {stored["config_hash"], stored["code_hash"]} < set(words(text))
    assert {x.tag for x in page.iter()} & {"script", "link", "iframe", "object"} == set()
    links = [x.get(name, "#") for x in page.iter() for name in ("src", "href")]
    assert all(x.startswith(("#", "data:")) for x in links)
    assert "@import" not in text
    assert "url(" not in text
    for departure in DEPARTURES.rows:
        assert set(departure) <= set(words(text))


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts of the page have no pictures."""
    monkeypatch.setattr(render, "image", lambda *_: b"")
    monkeypatch.setattr(report, "picture", lambda _: "")


@pytest.mark.usefixtures("undrawn")
def test_what_results_say_of_themselves_is_text_not_markup() -> None:
    result = reference("fig2")
    result["attributes"]["name"] = "<script>alert(1)</script>"
    result["provenance"]["system"] = "<b>bold</b>"
    table = Table("<b>caption</b>", ("<b>name</b>",), [("<b>cell</b>",)], "<b>note</b>")
    page = report.html([report.section(result)._replace(tables=[table])])
    assert {x.tag for x in parsed(page).iter()} & {"script", "b"} == set()
    told = {f"<b>{word}</b>" for word in ("bold", "caption", "name", "cell", "note")}
    assert told < set(words(page))


def test_table_1_is_the_paper_s_beside_the_file_s_for_its_bodies_alone() -> None:
    result = reference("fig3")
    data = result["data"]
    [table] = asymptotic_surfaces.tables(result)
    for k in (1, 3):
        for row in table.rows:
            assert float(row[k]) == pytest.approx(float(row[k + 1]), abs=5.1e-6)
    assert [row[2] for row in table.rows] == [f"{x:.7f}" for x in data["table"]["alpha0"]]
    data["table"] = {name: column[:1] for name, column in data["table"].items()}
    data["bodies"] = {"a": data["bodies"]["a"]}
    [found] = asymptotic_surfaces.tables(result)
    assert [row[1] for row in found.rows] == [""]


@pytest.mark.usefixtures("undrawn")
def test_the_routes_are_the_paper_s_beside_the_file_s_for_its_figure_alone() -> None:
    result = reference("fig5")
    routes, plateaus = herpolhodes.tables(result)
    assert [row[1] for row in routes.rows] == list(herpolhodes.ROUTES.values())
    assert [row[2] for row in routes.rows] == [row[1] for row in routes.rows]
    assert {row[2] for row in plateaus.rows} == {herpolhodes.INCREMENT}
    assert {row[3] for row in plateaus.rows} == {herpolhodes.INCREMENT}
    assert report.section(result).title == "Fig. 5: herpolhodes"
    result["attributes"]["figure"] = ""
    routes, plateaus = herpolhodes.tables(result)
    assert {row[1] for row in routes.rows} == {row[2] for row in plateaus.rows} == {""}
    assert report.section(result).title == "Herpolhodes: fig5"


ROWS = {
    "closed_orbits": [["0", "37.947128"], ["1", "2", "2.841028381"]],
    "exponents": [["1", "9.9454"]],
    "asymptotic_orbits": [["0", "2", "heteroclinic", "1"], ["a", "heteroclinic", "1.5627"]],
    "fig1": [["M1", "0.3", "2", "0.515"], ["1", "-0.3398369095", "0.6666666667"]],
    "fig2": [["1", "-0.3398369095", "0"], ["0, left", "2* to 1*, 4* to 3*, 1 to 4, 3 to 2"]],
    "fig4": [["left", "63", "945", "945"]],
    "precession": [["i", "0.260192 (0.256510)"], ["i", "1 = 2 > 0 > 3 = 4", "2.0"]],
    "route_map": [["whole", "500", "180", "540000", "540000"]],
}
"""What the first rows of each table begin with."""


@pytest.mark.parametrize("name", ROWS)
def test_each_table_tells_the_numbers_of_the_file(name: str) -> None:
    result = shared_reference(name)
    tables = experiments.tables(result)
    for table, expected in zip(tables, ROWS[name], strict=True):
        *whole, last = zip(table.rows[0], expected, strict=False)
        assert all(found == known for found, known in whole)
        assert last[0].startswith(last[1])


def test_pictures_take_little_room_in_the_page() -> None:
    """Fig. 3 is the largest: shaded surfaces, 4 MB with all their colours."""
    drawn = (REFERENCE.parent / "gallery" / "fig3.png").read_bytes()
    assert 20_000 < len(report.picture(drawn)) < 1_200_000


def test_a_page_that_cannot_be_built_leaves_the_old_one(tmp_path: Path) -> None:
    with pytest.raises(files.StoreError, match="no results; call: rigidpend run all"):
        report.build(report.results(tmp_path))
    target = tmp_path / "report.html"
    target.write_text("old")
    (tmp_path / "fig1.h5").write_bytes(b"no HDF5")
    with pytest.raises(files.StoreError):
        report.write(report.results(tmp_path), target)
    assert target.read_text() == "old"


@pytest.mark.usefixtures("undrawn")
def test_a_page_where_nothing_can_be_written_is_to_be_written_elsewhere(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(files.StoreError, match=r"choose another file with --to$"):
        report.write([REFERENCE / "fig2.h5"], tmp_path / "file" / "x.html")


@pytest.mark.usefixtures("undrawn")
def test_one_bad_file_is_a_section_and_a_bad_certificate_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(report, "FEW", 4)
    shutil.copyfile(REFERENCE / "fig2.h5", tmp_path / "good.h5")
    shutil.copyfile(REFERENCE / "fig4.h5", tmp_path / "fig4.h5")
    (tmp_path / "fig4.certificate.h5").write_bytes(b"none")
    (tmp_path / "bad.h5").write_bytes(b"no HDF5")
    (tmp_path / "folder.h5").mkdir()
    page, problems = report.build(report.results(tmp_path))
    [said] = [said for said in problems if said.startswith("nothing is marked as proven: ")]
    assert said in " ".join(words(page))
    assert len(problems) == 3
    assert page.count('class="problem"') == 3
    assert page.count("<img ") == 2


BODY = {"A": ["2", "1", "3/2"], "mu": "1/1000", "h0": "1"}
SEVERAL = {"a": {"A": ["2", "1", "3/2"]}, "b": ["2", "1", "6/5"]}


@pytest.mark.parametrize(
    ("problem", "told"),
    [
        # Phases along an axis are not what all orbits share.
        ({**BODY, "theta2_0": {"count": 5}}, ["A = (2, 1, 1.5), mu = 0.001, h0 = 1"]),
        (
            {"theta2_0": "47/10", "J1_0": "1e-8", "r": ["1", "1", "0"], **BODY},
            ["A = (2, 1, 1.5), r along (1, 1, 0), mu = 0.001, h0 = 1, J1_0 = 1e-8, theta2_0 = 4.7"],
        ),
        (
            {**BODY, "half_turns": 14, "approach": "a 0^8"},
            ["A = (2, 1, 1.5), mu = 0.001, h0 = 1, half_turns = 14, approach = a 0^8"],
        ),
        (
            {**BODY, "beta0": "1/2", "h0": "7" * 1000},
            [f"A = (2, 1, 1.5), beta0 = 0.5, mu = 0.001, h0 = {'7' * 300}"],
        ),
        (
            {"mu": "1/10", "h": ["1", "2", "3", "4"], "beta0": None, "bodies": SEVERAL},
            [
                "beta0 = gamma0, mu = 0.1, h = 1 to 4 (4 values)",
                "a: A = (2, 1, 1.5)",
                "b: A = (2, 1, 1.2)",
            ],
        ),
        ({"mu": "1/10"}, []),
        (["1"], []),
    ],
)
def test_the_foot_says_what_one_sees_with_the_name_and_the_bodies(
    problem: Any, told: list[str]
) -> None:
    attributes = {"experiment": "route_codes", "name": "light"}
    result: Any = {"attributes": attributes, "config": {"problem": problem}}
    assert captions.bodies(result) == told
    seen, one = captions.foot(result)
    assert captions.caption("route_codes").startswith(f"{seen} A column ")
    assert one == ": ".join(["light", *filter(None, ["; ".join(told)])])
