"""The report in a real browser: it fits a phone and a desk, its figures load, it prints."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from rigidpend import render
from rigidpend.render import report
from scripts import browser, look
from tests.cli.calls import REFERENCE
from tests.render import in_gallery

LOOK = """page => ({
  inner: page.documentElement.clientWidth, content: page.documentElement.scrollWidth,
  pictures: [...page.images].map(i => i.complete && i.naturalWidth),
  smallest: Math.min(...[...page.querySelectorAll("p, td, th, a")]
    .map(x => parseFloat(getComputedStyle(x).fontSize)))})"""


@pytest.mark.slow
@pytest.mark.skipif(
    browser.BROWSER is None, reason="no Chromium: the report's layout is not tested"
)
def test_the_page_fits_a_phone_and_a_desk_and_prints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(render, "image", in_gallery)
    # To begin processes takes longer than these few.
    monkeypatch.setattr(report, "FEW", 4)
    names = ("fig2", "fig3", "fig4", "fig5")
    report.write([REFERENCE / f"{name}.h5" for name in names], tmp_path / "report.html")
    for width in (390, 1200):
        found = browser.measured(tmp_path, ["report.html"], width, LOOK)["report.html"]
        assert found["inner"] <= width
        assert found["content"] <= found["inner"], "the page itself scrolls sideways"
        assert len(found["pictures"]) == 4
        assert all(size > 1000 for size in found["pictures"])
        assert found["smallest"] >= 13
    browser.browse(tmp_path, f"--print-to-pdf={tmp_path / 'page.pdf'}", "report.html")
    pages = re.findall(rb"/Type\s*/Page\b", (tmp_path / "page.pdf").read_bytes())
    assert 2 <= len(pages) <= 12


@pytest.mark.slow
@pytest.mark.skipif(browser.BROWSER is None, reason="no Chromium: no page is looked at")
def test_a_formula_that_is_wrong_unset_or_too_wide_is_seen(tmp_path: Path) -> None:
    (tmp_path / "sound.html").write_text("<p>Words.</p>")
    long = f'<span class="math">{"x" * 200}</span>'
    (tmp_path / "wide.html").write_text(f'<span class="math">\\(a & b</span>{long}')
    (tmp_path / "wrong.html").write_text('<p class="math"><i data-mjx-error="Misplaced &amp;"></p>')
    said = browser.measured(tmp_path, ["sound.html", "wide.html", "wrong.html"], 400, look.LOOK)
    assert look.faults(said["sound.html"]) == []
    unset, long, off, page = look.faults(said["wide.html"])
    assert unset.endswith("& b' is not set")
    assert long.endswith("xx' is not set")
    assert off.endswith("xx' runs off the page")
    assert page.startswith("the page is ")
    assert "a formula is wrong: Misplaced &" in look.faults(said["wrong.html"])
