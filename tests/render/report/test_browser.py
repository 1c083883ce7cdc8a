"""The report in a real browser: it fits a phone and a desk, its figures load, it prints."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from rigidpend import render
from rigidpend.render import report

REFERENCE = Path(__file__).resolve().parents[3] / "results" / "reference"
BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
QUIET = """--headless --no-sandbox --disable-gpu --disable-quic --no-first-run
--disable-background-networking --disable-component-update --disable-sync
--allow-file-access-from-files --virtual-time-budget=8000""".split()  # noqa: SIM905
MEASURE = """<!doctype html><iframe src="report.html" style="width:{width}px;height:900px"></iframe>
<pre id="found"></pre><script>
document.querySelector("iframe").onload = e => {{
  const page = e.target.contentDocument, root = page.documentElement;
  const letters = [...page.querySelectorAll("p, td, th, a")];
  document.getElementById("found").textContent = JSON.stringify({{
    inner: root.clientWidth, content: root.scrollWidth,
    pictures: [...page.images].map(i => i.complete && i.naturalWidth),
    smallest: Math.min(...letters.map(x => parseFloat(getComputedStyle(x).fontSize))),
    height: root.scrollHeight}});
}};</script>"""


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="no Chromium: the report's layout is not tested")
def test_the_page_fits_a_phone_and_a_desk_and_prints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Half as fine as usual, and wider than the page still.
    monkeypatch.setattr(render, "PIXELS", 1100)
    for name in ("fig2", "fig3", "fig4", "fig5"):
        shutil.copyfile(REFERENCE / f"{name}.h5", tmp_path / f"{name}.h5")
    report.write(report.results(tmp_path), tmp_path / "report.html")
    for width in (390, 1200):
        found = measured(tmp_path, width)
        assert found["inner"] <= width
        assert found["content"] <= found["inner"], "the page itself scrolls sideways"
        assert len(found["pictures"]) == 4
        assert all(size > 1000 for size in found["pictures"])
        assert found["smallest"] >= 13
    browse(tmp_path, f"--print-to-pdf={tmp_path / 'page.pdf'}", "report.html")
    pages = re.findall(rb"/Type\s*/Page\b", (tmp_path / "page.pdf").read_bytes())
    assert 2 <= len(pages) <= 12


def measured(folder: Path, width: int) -> Any:
    """What the page measures in a frame of that many CSS pixels."""
    (folder / "measure.html").write_text(MEASURE.format(width=width))
    dumped = browse(folder, "--dump-dom", "measure.html")
    [text] = re.findall(r'<pre id="found">(.*?)</pre>', dumped)
    return json.loads(text)


def browse(folder: Path, what: str, page: str) -> str:
    """Let the browser open a page of the folder."""
    assert BROWSER is not None
    call = [
        BROWSER,
        *QUIET,
        f"--user-data-dir={folder / 'profile'}",
        what,
        f"file://{folder / page}",
    ]
    return subprocess.run(call, capture_output=True, text=True, timeout=120, check=True).stdout
