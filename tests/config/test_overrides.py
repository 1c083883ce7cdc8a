"""Overrides: `--set a.b=VALUE` is as if it were written in the file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rigidpend.config import catalogue
from rigidpend.config.complaints import ConfigError
from rigidpend.experiments.route_codes.schema import Config
from rigidpend.runs import loading
from tests.config.samples import FIG4, TEXT, changed, content, refused, written

LEFT, RIGHT = (
    {"start": start, "step": step, "count": count}
    for start, step, count in (("0", "1/10", 63), ("3*pi/40", "1/100", 32))
)
ONE, ARRAY = "{start: 0, step: 1/2, count: 3}", {"start": "0", "step": "1/2", "count": 3}
WHOLE, COUNT = f"problem.arrays={{left: {ONE}}}", "problem.arrays.left.count=5"


@pytest.mark.parametrize(
    ("settings", "key", "expected"),
    [
        (["problem.mu=1e-10"], "mu", "1/10000000000"),
        (["problem.mu= 1/3 "], "mu", "1/3"),
        (["problem.mu='2e-3'"], "mu", "1/500"),
        (["problem.mu=2e-3 # as printed"], "mu", "1/500"),
        (["problem.A.2=1.75"], "A", ["2", "1", "7/4"]),
        (["problem.A=[3, 1, 2.5]"], "A", ["3", "1", "5/2"]),
        ([f"problem.arrays={{one: {ONE}}}"], "arrays", {"one": ARRAY}),
        ([f"problem.arrays.new={ONE}"], "arrays", {"left": LEFT, "right": RIGHT, "new": ARRAY}),
        # Later ones win.
        (["problem.mu=0.1", "problem.mu=0.2"], "mu", "1/5"),
        ([COUNT, WHOLE], "arrays", {"left": ARRAY}),
        ([WHOLE, COUNT], "arrays", {"left": {**ARRAY, "count": 5}}),
    ],
)
def test_a_value_a_whole_list_or_a_mapping_is_replaced_or_added_and_the_rest_stays(
    settings: list[str], key: str, expected: Any
) -> None:
    loaded, resolved = loading.load(FIG4, settings), loading.load(FIG4).resolved()
    resolved["problem"][key], resolved["figure"] = expected, ""
    assert (loaded.name, loaded.resolved()) == ("fig4", resolved)


def test_what_the_file_leaves_out_or_has_wrong_can_be_set(tmp_path: Path) -> None:
    bare = written(tmp_path, TEXT[: TEXT.index("numerics:")])
    assert content(Config, bare, ["numerics.engine=scipy"]).numerics.engine == "scipy"
    wrong = written(tmp_path, changed("mu: 0.001", "mu: x"))
    assert content(Config, wrong, ["problem.mu=0"]).problem.mu.fraction == 0


def test_the_word_that_the_settings_show_for_a_default_is_taken() -> None:
    given = [f"problem.{key}=auto" for key in ("half_turns", "approach", "h0")]
    problem = loading.load(catalogue.known()["full_shift"], given).content.problem
    assert problem.model_dump(include={"half_turns", "approach", "h0"}) == dict.fromkeys(
        ("h0", "half_turns", "approach")
    )


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


@pytest.mark.parametrize(
    "setting",
    ["nope.x=1", "problem.arrays.new.start=0", "problem.A.0=0.5", f"problem.A.{'9' * 5000}=1"],
    ids=["unknown part", "half an array", "one moment", "huge index"],
)
def test_what_a_setting_breaks_is_said_of_the_setting(setting: str) -> None:
    for problem in refused(FIG4, [setting]):
        assert str(problem).startswith(f"--set {setting}"[:200])


def test_all_wrong_settings_are_said_at_once() -> None:
    given = ["no", "problem.A.7=1", "problem.h0=[", "problem.mu=x", "problem.J1_0=1e-9"]
    found = refused(FIG4, given)
    assert [str(problem.origin) for problem in found] == [f"--set {x}" for x in given[:4]]


def test_of_an_axis_the_ends_are_named_that_are_excluded() -> None:
    given = ["problem.rows.count=40", "problem.zooms={}", "problem.rows.ends=[1e-6, 2]"]
    [path] = catalogue.resolve(("route_map",))
    with pytest.raises(ConfigError, match="h0 > mu is broken") as error:
        loading.load(path, given)
    assert [str(x.origin) for x in error.value.complaints] == [f"--set {given[2]}"]
