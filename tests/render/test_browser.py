"""The report in a real browser: it fits a phone and a desk, its figures load, it prints."""

import re
from pathlib import Path
from typing import Any

import pytest

from rigidpend import render
from rigidpend.render import report
from scripts import browser, look
from tests.cli.calls import REFERENCE

pytestmark = pytest.mark.skipif(browser.BROWSER is None, reason="no Chromium: no page is looked at")

LOOK = f"""page => ({{...({look.LOOK})(page),
  pictures: [...page.images].map(i => i.complete && i.naturalWidth),
  smallest: Math.min(...[...page.querySelectorAll("p, td, th, a")]
    .map(x => parseFloat(getComputedStyle(x).fontSize)))}})"""
LONG = f'<span class="math">{"x" * 200}</span>'
PAGES = {
    "sound.html": "<p>Words.</p>",
    "wide.html": f'<span class="math">\\(a & b</span>{LONG}',
    "wrong.html": '<p class="math"><i data-mjx-error="Misplaced &amp;"></p>',
}
WIDTHS = (390, 1200)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a report of four results, and pages with formulas."""
    made = tmp_path_factory.mktemp("pages")
    with pytest.MonkeyPatch.context() as patch:
        # The same light picture in all sections; their tables differ.
        light = (REFERENCE.parent / "gallery" / "fig2.png").read_bytes()
        patch.setattr(render, "image", lambda *_: light)
        # To begin processes takes longer than these few.
        patch.setattr(report, "FEW", 4)
        names = ("fig2", "fig3", "fig4", "fig5")
        report.write([REFERENCE / f"{name}.h5" for name in names], made / "report.html")
    for name, text in PAGES.items():
        (made / name).write_text(text)
    return made


@pytest.fixture(scope="module")
def found(folder: Path) -> dict[tuple[int, str], Any]:
    """What is found on all pages: the browser is begun once."""
    return browser.measured(folder, ["report.html", *PAGES], WIDTHS, LOOK)


@pytest.mark.slow
def test_the_page_fits_a_phone_and_a_desk(found: Any) -> None:
    for width in WIDTHS:
        page = found[width, "report.html"]
        assert page["inner"] <= width
        assert page["content"] <= page["inner"], "the page itself scrolls sideways"
        assert len(page["pictures"]) == 4
        assert all(size > 1000 for size in page["pictures"])
        assert page["smallest"] >= 13


@pytest.mark.slow
def test_the_page_prints(folder: Path) -> None:
    browser.browse(folder, f"--print-to-pdf={folder / 'page.pdf'}", "report.html")
    pages = re.findall(rb"/Type\s*/Page\b", (folder / "page.pdf").read_bytes())
    assert 2 <= len(pages) <= 12


@pytest.mark.slow
def test_a_formula_that_is_wrong_unset_or_too_wide_is_seen(found: Any) -> None:
    sound, wide, wrong = (look.faults(found[WIDTHS[0], name]) for name in PAGES)
    assert sound == []
    unset, long, off, page = wide
    assert unset.endswith("& b' is not set")
    assert long.endswith("xx' is not set")
    assert off.endswith("xx' runs off the page")
    assert page.startswith("the page is ")
    assert "a formula is wrong: Misplaced &" in wrong
