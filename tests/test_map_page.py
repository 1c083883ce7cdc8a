"""The figure and the table on the page of the return map."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
import pytest

from rigidpend.mechanics.body import Body
from rigidpend.orbits.return_map import MapError, return_map
from rigidpend.render import STYLE
from scripts import map_page

PAGE = Path(__file__).resolve().parents[1] / "docs" / "return-map.md"


def test_coefficients_fall_geometrically_to_rounding() -> None:
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
        assert rate is None or abs(slope / np.log(rate) - 1) < 0.35
    with matplotlib.rc_context(fname=STYLE):
        figure = map_page.draw([made])
    assert figure.axes[0].get_xlabel() == "degree $j + k$"
    assert all(axes.get_yscale() == "log" for axes in figure.axes)


def test_the_table_names_reach_and_reason() -> None:
    rows = [("a body", "0.03", "1e-03", "1e-02", "-", "mu is too large")]
    table = map_page.limits_table(rows)
    assert len(table.header) == len(rows[0])
    assert "0.045" in table.note
    text = PAGE.read_text(encoding="utf-8")
    block = text.partition("<!-- limits -->")[2].partition("<!-- /limits -->")[0]
    assert set(map_page.BODIES) == {
        line.split("|")[1].strip() for line in block.splitlines() if line.startswith("| ")
    } - {"body", "---"}


def test_a_start_within_the_normal_form_is_found_and_one_without_weight_has_none() -> None:
    start = map_page.largest_start(Body(map_page.A, map_page.R, "0.001"), map_page.H0)
    assert 1e-5 < start < 1e-1
    with pytest.raises(MapError, match="nothing is split"):
        map_page.largest_start(Body(map_page.A, map_page.R, 0), map_page.H0)
