"""Overrides: `--set a.b=VALUE` is as if it were written in the file."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from rigidpend.config import catalogue
from rigidpend.experiments.route_codes.schema import Config
from rigidpend.runs import loading
from tests.config.samples import FIG4, changed, content, refused, written


def problem_with(*settings: str) -> Any:
    return loading.load(FIG4, settings).content.problem


def test_a_value_is_replaced_and_the_rest_stays() -> None:
    loaded = loading.load(FIG4, ["problem.mu=1e-10"])
    expected = loading.load(FIG4).resolved()
    expected["problem"]["mu"] = "1/10000000000"
    expected["figure"] = ""
    assert loaded.resolved() == expected
    assert loaded.name == "fig4"


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        ("problem.mu=0.1", Fraction(1, 10)),
        ("problem.mu= 1/3 ", Fraction(1, 3)),
        ("problem.mu='2e-3'", Fraction(1, 500)),
        ("problem.mu=1e-3 # as printed", Fraction(1, 1000)),
    ],
)
def test_values_are_typed_as_in_the_file(setting: str, value: Fraction) -> None:
    assert problem_with(setting).mu.fraction == value


ONE = "{start: 0, step: 1/2, count: 3}"


@pytest.mark.parametrize(
    ("setting", "key", "expected"),
    [
        ("problem.A.2=1.75", "A", ["2", "1", "7/4"]),
        ("problem.A=[3, 1, 2.5]", "A", ["3", "1", "5/2"]),
        (f"problem.arrays={{one: {ONE}}}", "arrays", ["one"]),
        (f"problem.arrays.new={ONE}", "arrays", ["left", "right", "new"]),
    ],
)
def test_an_entry_a_whole_list_or_a_mapping_is_replaced_or_added(
    setting: str, key: str, expected: list[str]
) -> None:
    assert list(loading.load(FIG4, [setting]).resolved()["problem"][key]) == expected


def test_a_part_that_the_file_leaves_out_is_made(tmp_path: Path) -> None:
    text = FIG4.read_text(encoding="utf-8")
    path = written(tmp_path, text[: text.index("numerics:")])
    assert content(Config, path, ["numerics.engine=scipy"]).numerics.engine == "scipy"


def test_the_word_that_the_settings_show_for_a_default_is_taken() -> None:
    given = [f"problem.{key}=auto" for key in ("half_turns", "approach", "h0")]
    problem = loading.load(catalogue.known()["full_shift"], given).content.problem
    assert problem.model_dump(include={"half_turns", "approach", "h0"}) == dict.fromkeys(
        ("h0", "half_turns", "approach")
    )


def test_later_settings_win() -> None:
    assert problem_with("problem.mu=0.1", "problem.mu=0.2").mu.fraction == Fraction(1, 5)
    whole = "problem.arrays={left: {start: 0, step: 1, count: 2}}"
    assert problem_with("problem.arrays.left.count=5", whole).arrays["left"].count == 2
    assert problem_with(whole, "problem.arrays.left.count=5").arrays["left"].count == 5


def test_what_is_wrong_in_the_file_can_be_set_right(tmp_path: Path) -> None:
    path = written(tmp_path, changed("mu: 0.001", "mu: x"))
    assert content(Config, path, ["problem.mu=0"]).problem.mu.fraction == 0


REFUSED = """
problem.n_symbls=3 | problem.n_symbls: unknown key; did you mean n_symbols? (known: A, r, mu, h0,
problem.A.3=1 | problem.A: has no entry '3': it is a list of 3
problem.A.-1=1 | problem.A: has no entry '-1': it is a list of 3
problem.mu.x=1 | problem.mu: has no entry 'x': it is a single value
problem.mu | expected KEY.KEY=VALUE, as in problem.mu=1e-3
=1 | expected KEY.KEY=VALUE, as in problem.mu=1e-3
problem..mu=1 | expected KEY.KEY=VALUE, as in problem.mu=1e-3
problem.mu=[1 | not YAML
problem.mu=*a | anchors and aliases are not read
problem.mu= | problem.mu: expected a number, such as 0.1, 1e-6, 1/10 or 3*pi/40
problem.h0=-1 | problem.h0: h0 > mu is broken: h0 = -1, mu = 0.001
problem.A=[2, 1] | problem.A.2: required
experiment=route_code | experiment: no such experiment: 'route_code'; did you mean route_codes?
"""
"""A setting, and what is said behind it."""


@pytest.mark.parametrize("case", REFUSED.strip().splitlines())
def test_a_wrong_setting_is_named_with_what_is_wrong(case: str) -> None:
    setting, said = case.split(" | ")
    [problem] = refused(FIG4, [setting])
    assert str(problem).startswith(f"--set {setting}: {said}")


def test_the_file_s_own_errors_keep_their_places(tmp_path: Path) -> None:
    path = written(tmp_path, changed("mu: 0.001", "mu: x"))
    in_setting, in_file = refused(path, ["problem.n_symbols=1/2"])
    assert str(in_file).startswith(f"{path}:8:7: problem.mu: ")
    assert str(in_setting).startswith("--set problem.n_symbols=1/2: problem.n_symbols: ")


@pytest.mark.parametrize(
    "setting",
    [
        "nope.x=1",
        "problem.arrays.new.start=0",
        "problem.A.0=0.5",
        f"problem.A.{'9' * 5000}=1",
    ],
    ids=["unknown part", "half an array", "one moment", "huge index"],
)
def test_what_a_setting_breaks_is_said_of_the_setting(setting: str) -> None:
    for problem in refused(FIG4, [setting]):
        assert str(problem).startswith(f"--set {setting}"[:200])


def test_all_wrong_settings_are_said_at_once() -> None:
    given = ["no", "problem.A.7=1", "problem.h0=[", "problem.mu=x", "problem.J1_0=1e-9"]
    found = refused(FIG4, given)
    assert [str(problem.origin) for problem in found] == [f"--set {x}" for x in given[:4]]
