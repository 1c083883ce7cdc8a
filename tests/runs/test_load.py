"""Loading: the shipped config, exact numbers, defaults, and all errors at once."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from rigidpend.experiments.route_codes.schema import Config
from rigidpend.runs import loading
from tests.config.samples import FIG4, TEXT, changed, content, refused, written


def test_fig4_holds_the_paper_s_values_exactly_and_leaves_the_numerics_to_the_engine() -> None:
    loaded = loading.load(FIG4)
    assert (loaded.name, loaded.experiment, loaded.content.figure) == ("fig4", "route_codes", "4")
    resolved = loaded.resolved()
    assert json.loads(json.dumps(resolved)) == resolved
    assert resolved["problem"] == {
        "A": ["2", "1", "3/2"],
        "r": ["1", "1", "0"],
        "mu": "1/1000",
        "h0": "6671/5000",
        "J1_0": "1/100000000",
        "n_symbols": 15,
        "arrays": {
            "left": {"start": "0", "step": "1/10", "count": 63},
            "right": {"start": "3*pi/40", "step": "1/100", "count": 32},
        },
    }
    problem: Any = loaded.content.problem
    assert list(problem.arrays) == ["left", "right"]
    right = problem.arrays["right"]
    assert (problem.h0.fraction, right.start.fraction) == (Fraction(13342, 10000), None)
    assert float(right.start) == 0.23561944901923448
    numerics = content(Config, FIG4).numerics
    assert (numerics.engine, numerics.tolerance) == (None, None)
    assert numerics.precisions == (53, 106, 160)


def test_what_is_left_out_has_the_default_that_may_be_written(tmp_path: Path) -> None:
    bare = TEXT[: TEXT.index("numerics:")].replace("  n_symbols: 15\n", "")
    assert loading.load(written(tmp_path, bare)).content == loading.load(FIG4).content


def test_only_the_paper_s_own_problem_has_the_name_of_its_figure(tmp_path: Path) -> None:
    assert loading.load(FIG4).content.figure == "4"
    assert loading.load(written(tmp_path, TEXT)).content.figure == "4"
    assert loading.load(FIG4, ["numerics.engine=scipy"]).content.figure == "4"
    assert loading.load(FIG4, ["problem.mu=0.01"]).content.figure == ""
    other = changed("A: [2, 1, 1.5]", "A: [3, 2, 2.5]")
    assert loading.load(written(tmp_path, other)).content.figure == ""
    zoom = FIG4.with_name("fig4_zoom.yaml")
    assert loading.load(zoom).content.figure == "4, zoomed"
    assert loading.load(zoom, ["problem.mu=0.01"]).content.figure == ""
    # A name that is not the paper's stays.
    mine = changed('figure: "4"', "figure: mine")
    assert loading.load(written(tmp_path, mine), ["problem.mu=0.01"]).content.figure == "mine"


def test_no_experiment_is_an_error_with_all_that_there_are(tmp_path: Path) -> None:
    [problem] = refused(written(tmp_path, changed("experiment: route_codes", "")))
    assert problem.place == ("experiment",)
    assert "route_codes" in problem.message


def test_what_is_wrong_in_several_files_is_said_at_once(tmp_path: Path) -> None:
    wrong = changed("mu: 0.001", "mu: x")
    paths = [written(tmp_path, wrong, "a.yaml"), FIG4, written(tmp_path, wrong, "b.yaml")]
    with pytest.raises(loading.ConfigError) as caught:
        loading.load_all(paths, ["problem.h0=y"])
    origins = [str(problem.origin) for problem in caught.value.complaints]
    # The setting is the same for all, and said once.
    assert [x.rpartition("/")[2] for x in origins] == [
        *("--set problem.h0=y", "a.yaml:8:7", "b.yaml:8:7")
    ]
