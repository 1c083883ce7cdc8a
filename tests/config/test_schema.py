"""What a config may hold: everything wrong is shown with file, line, column and caret."""

from __future__ import annotations

from pathlib import Path

import pytest

from rigidpend.experiments.route_codes.schema import Config
from rigidpend.runs import loading
from tests.config.samples import SMALL, changed, content, refused, refused_there, written

NUMBER = "expected a number, such as 0.1, 1e-6, 1/10 or 3*pi/40"
PROBLEM_KEYS = "(known: A, r, mu, h0, J1_0, n_symbols, arrays)"


WRONG = {
    # What is written instead of what; where the caret must be; place and message.
    "misspelt key": (
        "n_symbols: 15",
        "n_symbls: 15",
        "n_symbls",
        "problem.n_symbls",
        f"unknown key; did you mean n_symbols? {PROBLEM_KEYS}",
    ),
    "key like no other": (
        "n_symbols: 15",
        "zzz: 15",
        "zzz",
        "problem.zzz",
        f"unknown key {PROBLEM_KEYS}",
    ),
    "misspelt part": (
        "numerics:",
        "numeric:",
        "numeric:",
        "numeric",
        "unknown key; did you mean numerics? (known: figure, experiment, problem, numerics)",
    ),
    "key that is missing": ("  h0: 1.3342", "", "problem:", "problem.h0", "required"),
    "key of an array that is missing": (
        "step: 1/100, ",
        "",
        "right:",
        "problem.arrays.right.step",
        "required",
    ),
    "number that is too few": ("[2, 1, 1.5]", "[2, 1]", "A:", "problem.A.2", "required"),
    "truth for a number": ("mu: 0.001", "mu: true", "true", "problem.mu", NUMBER),
    "list for a number": ("mu: 0.001", "mu: [1]", "[1]", "problem.mu", NUMBER),
    "number inside a list": ("1.5]", "[1.5]]", "[1.5]", "problem.A.2", NUMBER),
    "nothing for a number": ("mu: 0.001", "mu: null", "null", "problem.mu", NUMBER),
    "broken count": (
        "count: 63",
        "count: 6.5",
        "6.5",
        "problem.arrays.left.count",
        "6.5 is not a whole number",
    ),
    "no column": (
        "count: 63",
        "count: 0",
        "0}",
        "problem.arrays.left.count",
        "input should be greater than or equal to 1, got '0'",
    ),
    "too many columns": (
        "count: 63",
        "count: 1e9",
        "1e9",
        "problem.arrays.left.count",
        "input should be less than or equal to 10000000, got '1e9'",
    ),
    "engine that is none": (
        "engine: auto",
        "engine: turbo",
        "turbo",
        "numerics.engine",
        "expected auto, taylor or scipy, got 'turbo'",
    ),
    "engine that is misspelt": (
        "engine: auto",
        "engine: tailor",
        "tailor",
        "numerics.engine",
        "expected auto, taylor or scipy, got 'tailor'; did you mean taylor?",
    ),
    "tolerance of nothing": (
        "tolerance: auto",
        "tolerance: 0 ",
        "0  ",
        "numerics.tolerance",
        "tolerance must be more than 0 and at most 0.01, got 0",
    ),
    "tolerance too coarse": (
        "tolerance: auto",
        "tolerance: 1/2",
        "1/2",
        "numerics.tolerance",
        "tolerance must be more than 0 and at most 0.01, got 1/2",
    ),
    "precisions out of order": (
        "[53, 106, 160]",
        "[64, 53]",
        "[64",
        "numerics.precisions",
        "precisions must ascend, got (64, 53)",
    ),
    "precisions too close": (
        "[53, 106, 160]",
        "[53, 63]",
        "[53",
        "numerics.precisions",
        "precisions 53 and 63 are too close: computations that differ by fewer than 11 bits err"
        " nearly alike, so that their agreement tells nothing; take 64 or more after 53",
    ),
    "precision below doubles": (
        "[53, 106, 160]",
        "[52]",
        "[52",
        "numerics.precisions",
        "precisions must be whole numbers of bits from 53 to 9000, got (52,)",
    ),
    "list for a part": (
        "{start: 0, step: 1/10, count: 63}",
        "[0, 63]",
        "[0, 63]",
        "problem.arrays.left",
        "expected keys with values",
    ),
}


@pytest.mark.parametrize(("old", "new", "at", "place", "message"), WRONG.values(), ids=WRONG)
def test_an_error_has_its_place_its_line_and_a_caret(
    tmp_path: Path, old: str, new: str, at: str, place: str, message: str
) -> None:
    refused_there(tmp_path, changed(old, new), at, place, message)


@pytest.mark.parametrize(
    "text", ["nan", ".nan", "NaN", "inf", ".inf", "-.inf", "infinity", "1e9999", "1/0", "x", "no"]
)
def test_what_is_no_finite_number_is_refused_where_it_stands(tmp_path: Path, text: str) -> None:
    given = changed("1.5]", f"{text}]")
    assert text in refused_there(tmp_path, given, f"{text}]", "problem.A.2")


PHYSICS = {
    "moments not in order": ("A: [2, 1, 1.5]", "A: [1, 2, 1.5]", "A1 > A3 > A2 is broken"),
    "no triangle": ("A: [2, 1, 1.5]", "A: [4, 1, 1.5]", "the triangle inequality"),
    "no moment": ("A: [2, 1, 1.5]", "A: [2, -1, 1.5]", "A2 > 0 is broken: A = (2, -1, 1.5)"),
    "r out of its plane": ("r: [1, 1, 0]", "r: [1, 1, 1]", "r3 = 0 is broken: r = (1, 1, 1)"),
    "r outside its quadrant": ("r: [1, 1, 0]", "r: [1, -1, 0]", "r1, r2 >= 0 is broken"),
    "r without direction": ("r: [1, 1, 0]", "r: [0, 0, 0]", "r must have a direction"),
    "mu below zero": ("mu: 0.001", "mu: -0.001", "mu >= 0 is broken: mu = -0.001"),
    "h0 at mu": ("h0: 1.3342", "h0: 0.001", "h0 > mu is broken: h0 = 0.001, mu = 0.001"),
    "J1_0 of nothing": ("J1_0: 1e-8", "J1_0: 0.0", "0 < J1_0 < J2_0 is broken: J1_0 = 0.0"),
    "J1_0 above J2_0": ("J1_0: 1e-8", "J1_0: 1.5", "0 < J1_0 < J2_0 is broken: J1_0 = 1.5"),
    "J1_0 too small": ("J1_0: 1e-8", "J1_0: 1e-501", "J1_0 = 1e-501 is below 1e-500 J2_0"),
    "no symbol": (
        "n_symbols: 15",
        "n_symbols: 0",
        "n_symbols must be a whole number from 1 to 100000, got 0",
    ),
}


@pytest.mark.parametrize(("old", "new", "condition"), PHYSICS.values(), ids=PHYSICS)
def test_physics_out_of_range_is_located_at_its_key(
    tmp_path: Path, old: str, new: str, condition: str
) -> None:
    text, key = changed(old, new), new.partition(":")[0]
    value = text.index(new) + len(f"{key}: ")
    assert condition in refused_there(tmp_path, text, value, f"problem.{key}")


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
    ("old", "new", "at", "place"),
    [
        ("numerics:", "two words: 1\nnumerics:", "two", "two words"),
        ("n_symbols: 15", "two words: 15", "two", "problem.two words"),
    ],
)
def test_an_unknown_key_of_two_words_is_shown_where_it_stands(
    tmp_path: Path, old: str, new: str, at: str, place: str
) -> None:
    refused_there(tmp_path, changed(old, new), at, place)


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("tolerance: auto", "tolerance: 1e400", ("numerics", "tolerance")),
        ("h0: 1.3342", "h0: tan(pi/2)", ("problem", "h0")),
        ("n_symbols: 15", "n_symbols: 1e5000", ("problem", "n_symbols")),
        pytest.param(
            "start: 0",
            "start: 1e400",
            ("problem", "arrays", "left", "start"),
        ),
    ],
)
def test_a_number_beyond_all_doubles_is_refused_at_its_key(
    tmp_path: Path, old: str, new: str, place: tuple[str, ...]
) -> None:
    [problem] = refused(written(tmp_path, changed(old, new)))
    assert problem.place == place


def test_one_wrong_precision_is_one_error(tmp_path: Path) -> None:
    [problem] = refused(written(tmp_path, changed("[53, 106, 160]", "[x]")))
    assert problem.place == ("numerics", "precisions", 0)


def test_errors_come_in_the_order_of_the_file(tmp_path: Path) -> None:
    text = changed("engine: auto", "engine: turbo", changed("mu: 0.001", "mu: x"))
    text = changed("n_symbols: 15", "zzz: 15", changed("A: [2, 1, 1.5]", "A: [2, x, y]", text))
    found = refused(written(tmp_path, text))
    lines = [(problem.origin.line, problem.origin.column) for problem in found]
    assert lines == sorted(lines, key=lambda at: (at[0] or 0, at[1] or 0))
    places = [problem.place for problem in found]
    expected = [("A", 1), ("A", 2), ("mu",), ("zzz",)]
    said = [place[1:] for place in places if place[1:] in expected]
    assert said == expected
    assert places[-1] == ("numerics", "engine")


def test_broken_conditions_on_the_body_are_said_at_once(tmp_path: Path) -> None:
    text = changed("A: [2, 1, 1.5]", "A: [1, 2, 1.5]", changed("mu: 0.001", "mu: -1"))
    found = refused(written(tmp_path, changed("r: [1, 1, 0]", "r: [1, 1, 1]", text)))
    assert [problem.place[1:] for problem in found] == [("A",), ("r",), ("mu",)]


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
