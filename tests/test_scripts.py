"""What tools in scripts/ say: the audit of versions, stated errors, the page of the return map."""

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidpend.mechanics.body import Body
from rigidpend.orbits.return_map import MapError, return_map
from scripts import audit, lowest, map_page, readme_tables, stated, stated_maps

ROOT = Path(__file__).resolve().parents[1]
SOUND = {"name": "click", "version": "8.5.1", "vulns": []}
UNKNOWN = {"name": "numpy", "skip_reason": "Dependency not found"}
BAD = {"name": "h5py", "version": "3.13", "vulns": [{"id": "X-1", "fix_versions": ["3.14"]}]}
UNASKED = ["not audited: the service cannot be asked from here"]


@pytest.mark.parametrize(
    ("document", "verdict"),
    [
        (None, (UNASKED, False)),
        ({"dependencies": [UNKNOWN, UNKNOWN]}, (UNASKED, False)),
        ({"dependencies": [SOUND]}, (["1 versions audited"], False)),
        (
            {"dependencies": [SOUND, BAD, UNKNOWN]},
            (["h5py 3.13: X-1, mended in 3.14", "2 versions audited, 1 not found"], True),
        ),
    ],
)
def test_a_vulnerability_fails_and_silence_is_not_taken_for_soundness(
    document: Any, verdict: Any
) -> None:
    assert audit.verdict(document) == verdict


def test_every_pinned_version_is_asked_about() -> None:
    text = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    assert len(lines) - len(audit.pinned(text)) == 1, "heyoka alone is a range"


def test_the_lowest_versions_are_those_that_the_project_names() -> None:
    named = lowest.lowest('[project]\ndependencies = ["numpy>=2.0", "heyoka>=7.1,<8; x == \'y\'"]')
    assert named == ["numpy==2.0", "heyoka==7.1"]
    with pytest.raises(ValueError, match="'click<9' names no lowest version"):
        lowest.lowest('[project]\ndependencies = ["click<9"]')


@pytest.mark.parametrize("script", [map_page, readme_tables, stated, stated_maps])
def test_who_asks_for_help_gets_it_and_nothing_else(
    script: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", [script.__name__, "--help"])
    with pytest.raises(SystemExit) as ended:
        script.main()
    assert ended.value.code == 0
    assert script.__doc__.partition("\n")[0][:40] in capsys.readouterr().out


CASES = {
    "splitting": 1,
    "precession": 1,
    "exponents": 1,
    "closed_orbits`: `exponent_error": 3,
    "periodic_orbit": 4,
    "herpolhodes`: `crossing_error": 1,
}
"""Some that take some seconds; `scripts.stated` tries many more."""


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_a_true_error_is_less_than_is_stated_and_not_by_far_for_all(name: str) -> None:
    [one] = [each for each in stated.STATED if each.what.startswith(f"`{name}`")]
    assert 0.001 < stated.measured(one, CASES[name], 4)[-1] <= 1


def rows(page: Path, block: str) -> list[list[str]]:
    """The cells of a table on a page, without its head."""
    text = page.read_text(encoding="utf-8")
    shown = text.partition(f"<!-- {block} -->")[2].partition(f"<!-- /{block} -->")[0]
    lines = [line for line in shown.splitlines() if line.startswith("| ")]
    return [line.strip("| ").split(" | ") for line in lines[2:]]


def test_the_pages_have_every_stated_error_and_every_body_of_the_return_map() -> None:
    told = rows(stated.PAGE, "stated")
    assert [row[0] for row in told] == [each.what for each in stated.STATED]
    assert all(float(row[-1]) <= 1 for row in told)
    bodies = {row[0].strip() for row in rows(ROOT / "docs" / "return-map.md", "limits")}
    assert bodies == set(map_page.BODIES)


@pytest.mark.slow
def test_coefficients_of_a_return_map_fall_geometrically_to_rounding() -> None:
    body = Body(map_page.A, map_page.R, "0.001")
    made = return_map(body, h=("1.3332", "1.3352"))
    decays = [map_page.normal_form_decay(made), *map_page.chart_decays(made)]
    # Rates of the orders: r = sqrt(d/4Q) for each degree, (mu/h) and (mu/2h) for each harmonic.
    mu, h = 0.001, 1.3342
    for (order, size), rate in zip(decays, (None, None, mu / h, mu / (2 * h)), strict=True):
        assert size.max() == 1
        assert size[-1] < 1e-13
        middle = slice(1, max(3, int((size > 1e-13).sum())))
        slope = np.polyfit(order[middle], np.log(size[middle]), 1)[0]
        assert rate is None or abs(slope / math.log(rate) - 1) < 0.35
    assert 1e-5 < map_page.largest_start(body, map_page.H0) < 1e-1
    with pytest.raises(MapError, match="without weight"):
        map_page.largest_start(Body(map_page.A, map_page.R, 0), map_page.H0)
