"""Look at the built pages in a browser: formulas are set, and nothing runs off the page."""

import sys
from pathlib import Path
from typing import Any

from scripts import browser

LOOK = """page => {
  const root = page.documentElement, formulas = [...page.querySelectorAll(".math")];
  const scrolls = it =>
    it && (getComputedStyle(it).overflowX === "auto" || scrolls(it.parentElement));
  const wide = it => it.getBoundingClientRect().right > root.clientWidth + 1 && !scrolls(it);
  return {
    inner: root.clientWidth, content: root.scrollWidth,
    unset: formulas.filter(x => !x.querySelector("mjx-container")).map(x => x.textContent),
    wrong: formulas.filter(x => x.querySelector("[data-mjx-error], mjx-merror"))
      .map(x => x.querySelector("[data-mjx-error]")?.getAttribute("data-mjx-error") ?? "?"),
    scrolled: formulas.filter(it => it.scrollWidth > it.clientWidth + 1 && it.matches("div"))
      .map(x => x.textContent.slice(0, 60)),
    wide: formulas.filter(wide).map(x => x.textContent.slice(0, 60))};
}"""
WIDTHS = (400, 1200)
"""A phone's page and a desk's, in CSS pixels."""


def faults(found: dict[str, Any]) -> list[str]:
    """Sentences about what is wrong on a page."""
    said = [f"the formula {text!r} is not set" for text in found["unset"]]
    said += [f"a formula is wrong: {text}" for text in found["wrong"]]
    said += [f"the formula {text!r} runs off the page" for text in found["wide"]]
    if found["inner"] > WIDTHS[0]:
        said += [f"the formula {text!r} is wider than its column" for text in found["scrolled"]]
    if found["content"] > found["inner"]:
        said.append(f"the page is {found['content']} pixels wide in {found['inner']}")
    return said


def main(folder: Path) -> int:
    """Print the faults of all pages of a folder; 1 if there are any."""
    if browser.BROWSER is None:
        print("no Chromium: the pages are not looked at", file=sys.stderr)
        return 0
    names = sorted(path.name for path in folder.glob("*.html"))
    lines = [
        f"{name} at {width} pixels: {said}"
        for (width, name), found in browser.measured(folder, names, WIDTHS, LOOK).items()
        for said in faults(found)
    ]
    print("\n".join(lines) or f"{len(names)} pages looked at")
    return bool(lines)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
