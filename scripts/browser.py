"""A browser without a window, which opens pages from the disk and fetches nothing."""

import html
import json
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
"""Chromium; None where there is none."""
QUIET = """--headless --no-sandbox --disable-gpu --disable-quic --no-first-run
--disable-background-networking --disable-component-update --disable-sync
--allow-file-access-from-files --virtual-time-budget=20000""".split()  # noqa: SIM905
FRAME = """<!doctype html><meta charset="utf-8"><pre id="found"></pre><script>
const ready = page => page.defaultView.MathJax?.startup?.promise ?? Promise.resolve();
const look = {look};
async function open(name, width) {{
  const frame = document.createElement("iframe");
  frame.style = `width:${{width}}px;height:900px`;
  frame.src = name;
  const loaded = new Promise(done => frame.onload = done);
  document.body.append(frame);
  await loaded;
  const page = frame.contentDocument;
  await ready(page);
  const found = look(page);
  frame.remove();
  return found;
}}
(async () => {{
  const found = [];
  for (const width of {widths})
    for (const name of {names}) found.push([width, name, await open(name, width)]);
  document.getElementById("found").textContent = JSON.stringify(found);
}})();
</script>"""


def measured(
    folder: Path, names: Sequence[str], widths: Sequence[int], look: str
) -> dict[tuple[int, str], Any]:
    """What a function of JavaScript finds on pages of a folder, in frames of so many pixels.

    The function takes the page's document; formulas are set before.
    """
    frame = folder / "measure.html"
    frame.write_text(FRAME.format(look=look, widths=[*widths], names=json.dumps([*names])))
    try:
        [text] = re.findall(
            r'<pre id="found">(.*?)</pre>', browse(folder, "--dump-dom", frame.name)
        )
    finally:
        frame.unlink()
    return {(width, name): found for width, name, found in json.loads(html.unescape(text))}


def browse(folder: Path, what: str, page: str) -> str:
    """Let the browser open a page of the folder."""
    assert BROWSER is not None
    profile, place = f"--user-data-dir={folder / 'profile'}", f"file://{folder.resolve() / page}"
    call = [BROWSER, *QUIET, profile, what, place]
    try:
        return subprocess.run(call, capture_output=True, text=True, timeout=120, check=True).stdout
    finally:
        shutil.rmtree(folder / "profile", ignore_errors=True)
