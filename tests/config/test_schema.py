"""What a config may hold: everything wrong is shown with file, line, column and caret."""

from __future__ import annotations

from pathlib import Path

import pytest

from rigidpend.experiments.route_codes.schema import Config
from rigidpend.runs import loading
from tests.config.samples import SMALL, changed, content, refused, refused_there, written


@pytest.mark.parametrize("text", ["nan", ".nan", "inf", "-.inf", "1e9999", "1/0", "x", "no"])
def test_what_is_no_finite_number_is_refused_where_it_stands(tmp_path: Path, text: str) -> None:
    given = changed("1.5]", f"{text}]")
    assert text in refused_there(tmp_path, given, f"{text}]", "problem.A.2")


def test_limits_that_the_paper_admits_are_admitted(tmp_path: Path) -> None:
    flat = changed("A: [2, 1, 1.5]", "A: [2, 0.2, 1.8]")
    still = changed("mu: 0.001", "mu: 0", changed("r: [1, 1, 0]", "r: [0, 1, 0]", flat))
    assert content(Config, written(tmp_path, still)).problem.body.special_cases == ("flat",)


@pytest.mark.parametrize("name", ["'a b'", "1", "''", "../x", "x" * 41])
def test_an_array_s_name_must_be_a_short_word(tmp_path: Path, name: str) -> None:
    text = changed("only:", f"{name}:", SMALL)
    [problem] = refused(written(tmp_path, text))
    assert problem.origin.line == 12
    assert problem.place[:2] == ("problem", "arrays")


@pytest.mark.parametrize(
    ("step", "lost"), [("0", "doubles"), ("1e-400", "doubles"), ("-1e-17", "53 bits")]
)
def test_a_step_that_leaves_columns_equal_is_refused(tmp_path: Path, step: str, lost: str) -> None:
    text = SMALL.replace("step: 1/10", f"step: {step}")
    [problem] = refused(written(tmp_path, text))
    assert ".".join(map(str, problem.place)) == "problem.arrays.only.step"
    assert problem.message == (
        f"the step {step} leaves 5 columns equal in {lost}: take a larger one"
    )
    assert problem.origin.line == text[: text.index("step:")].count("\n") + 1


def test_a_step_counts_in_the_finest_precision_and_among_several_columns(tmp_path: Path) -> None:
    fine = SMALL.replace("step: 1/10", "step: 1e-17").replace("[53]", "[53, 106]")
    assert loading.load(written(tmp_path, fine))
    alone = SMALL.replace("step: 1/10, count: 5", "step: 0, count: 1")
    assert loading.load(written(tmp_path, alone))


def test_a_comment_without_a_blank_is_no_number(tmp_path: Path) -> None:
    [problem] = refused(written(tmp_path, SMALL.replace("mu: 0.001", "mu: 0.001#c")))
    assert problem.message.startswith(
        "'0.001#c' is not a number: a comment begins with a blank and a #"
    )
    assert loading.load(written(tmp_path, SMALL.replace("mu: 0.001", "mu: 0.001 #c")))
