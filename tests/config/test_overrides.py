"""Settings are as if written in the file; sweeps have every combination once, named by it."""

from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend.config import overrides, reader
from rigidpend.config.complaints import ConfigError
from rigidpend.runs import loading
from tests.config.samples import FIG4, SMALL, refused, written

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


def test_the_name_of_a_figure_has_up_to_100_characters() -> None:
    """It is left out of what is loaded: of a changed config the figure is another one."""
    assert loading.load(FIG4, [f"figure={'9' * 100}"]).name == "fig4"


REFUSED = """
problem.n_symbls=3 | problem.n_symbls: unknown key; did you mean n_symbols? (known: A, r, mu, h0,
problem.A.3=1 | problem.A: has no entry '3': it is a list of 3
problem.A.-1=1 | problem.A: has no entry '-1': it is a list of 3
problem.mu.x=1 | problem.mu: has no entry 'x': it is a single value
problem.mu | expected KEY.KEY=VALUE, as in problem.mu=1e-3
=1 | expected KEY.KEY=VALUE, as in problem.mu=1e-3
problem..mu=1 | expected KEY.KEY=VALUE, as in problem.mu=1e-3
problem.mu=[1 | not YAML
problem.mu=*a | anchors and aliases are not allowed
problem.mu= | problem.mu: expected a number, such as 0.1, 1e-6, 1/10 or 3*pi/40
problem.h0=-1 | problem.h0: h0 > mu is broken: h0 = -1, mu = 0.001
problem.A=[] | problem.A: expected 3 values, got 0
problem.A.0=0.5 | problem.A: A1 > A3 > A2 is broken
problem.A.HUGE=1 | problem.A: has no entry
DEEP=1 | more than 32 keys inside each other
figure=LONG | figure: expected text of at most 100 characters
problem.arrays.new.start=0 | problem.arrays.new.
nope.x=1 | nope: unknown key
experiment=route_code | experiment: no such experiment: 'route_code'; did you mean route_codes?
"""
"""A setting, and what is said behind it."""


@pytest.mark.parametrize("case", REFUSED.strip().splitlines())
def test_a_wrong_setting_is_named_with_all_that_is_wrong_with_it(case: str) -> None:
    for word, meant in (("HUGE", "9" * 5000), ("LONG", "9" * 101), ("DEEP", "a." * 32 + "a")):
        case = case.replace(word, meant)
    setting, said = case.split(" | ")
    for problem in refused(FIG4, [setting]):
        assert str(problem).startswith(f"--set {setting}: {said}"[:200])


def test_every_combination_has_a_result_named_by_its_values(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    read = Mock(wraps=reader.read)
    monkeypatch.setattr(reader, "read", read)
    given = ["problem.mu=1e-4,1e-3", "problem.J1_0=1e-8,1e-6,1e-7"]
    [members] = loading.load_swept([FIG4], (), given)
    assert [member.name for member in members] == [
        f"fig4_mu={mu}_J1_0={J1_0}" for mu in ("1e-4", "1e-3") for J1_0 in ("1e-8", "1e-6", "1e-7")
    ]
    # Once for the sweep, and at most once more to learn which figure of the paper it was.
    assert read.call_count <= 2
    assert [member.content.figure for member in members] == [*[""] * 3, "4", "", ""]
    third = members[2].resolved()["problem"]
    assert (third["mu"], third["J1_0"]) == ("1/10000", "1/10000000")
    assert third["h0"] == loading.load(FIG4).resolved()["problem"]["h0"]


def test_lists_and_expressions_are_values_too_and_names_tell_them() -> None:
    found = overrides.option("problem.A=[2, 1, 1.5],[3, 2, 2.5]")
    assert [text for text, _ in found] == ["problem.A=[2, 1, 1.5]", "problem.A=[3, 2, 2.5]"]
    data = {"a": (1, np.array(2.5), True, None), "b": {"c": "x"}}
    assert overrides.in_one_line(data) == "{a: [1, 2.5, true, null], b: {c: x}}"
    # Without the section; keys that are alike then are told in full.
    keys = ["problem.arrays.left.step", "problem.engine", "numerics.engine", "figure"]
    assert overrides.short_names(keys) == ["arrays.left.step", *keys[1:]]
    assert [*overrides.variants([found])] == ["_A=2,1,1.5", "_A=3,2,2.5"]
    swept = [f"problem.arrays.{name}.step=3*pi/40,pi/40" for name in ("left", "right")]
    members = [x for each in swept for [xs] in [loading.load_swept([FIG4], (), [each])] for x in xs]
    # The sweep of one array leaves the results of the other's alone.
    assert [member.name for member in members] == [
        f"fig4_arrays.{name}.step={step}"
        for name in ("left", "right")
        for step in ("3xpiover40", "piover40")
    ]


def test_a_file_of_any_name_can_be_swept(tmp_path: Path) -> None:
    path = written(tmp_path, SMALL, "my body (2).yaml")
    [found] = loading.load_swept([path], (), ["problem.mu=1e-4,1/2"])
    assert [x.name for x in found] == ["my body (2)_mu=1e-4", "my body (2)_mu=1over2"]


SWEPT = {
    "problem.mu=1,2 problem.mu=3,4": "a key is swept twice: problem.mu, problem.mu",
    "problem.mu": "--sweep problem.mu: expected KEY.KEY=VALUE,VALUE",
    "problem.mu=1": "a sweep of problem.mu needs two values or more",
    "problem.mu=1,1": "the value 1 is given twice",
    "problem.mu=1,[2": "--sweep problem.mu=1,[2: not YAML",
    "problem.mu=1/2,1over2": "1/2 and problem.mu=1over2 would have the same name _mu=1over2",
    "problem.mu=1e-4,1E-4": "would have the same name _mu=1E-4",
    f"problem.mu={0.5:.160f},0.1": "a name is made of up to 150 letters",
    "problem.mew=1,2": "--sweep problem.mew=1,2: problem.mew: unknown key (known: A, r, mu",
    "problem.mu=1e-4,5": "h0 > mu is broken",
    "problem.mu=" + ",".join(map(str, range(1001))): "more than 1000 combinations",
}


@pytest.mark.parametrize("options", SWEPT)
def test_what_is_wrong_with_a_sweep_is_named(options: str) -> None:
    with pytest.raises(ConfigError) as caught:
        loading.load_swept([FIG4], (), options.split())
    assert SWEPT[options] in str(caught.value)


NO_NAMES = ("", "a/b", "../x", "all", ".hidden", "x" * 200, "a\nb")
TAKEN = ("fig5.certificate", "Fig5.Certificate")
NAMES = dict.fromkeys(NO_NAMES, "a name is made of")
NAMES |= dict.fromkeys(TAKEN, "--name: choose another name than")


@pytest.mark.parametrize("name", NAMES)
def test_a_name_that_is_no_file_s_or_of_something_else_is_refused(name: str) -> None:
    with pytest.raises(ConfigError, match=NAMES[name]):
        loading.load_swept([FIG4], name=name)


def test_a_name_that_only_begins_like_a_certificate_s_is_free(tmp_path: Path) -> None:
    for name in ("console", "fig5.certificates", "a.b"):
        assert loading.load_swept([FIG4], name=name)[0][0].name == name
    # A file's name becomes that of its result.
    with pytest.raises(ConfigError, match="choose another name than"):
        loading.load(written(tmp_path, SMALL, f"{TAKEN[1]}.yaml"))
