"""Sweeps: every combination once, under a name that tells it, and what is wrong named."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import Mock

import pytest

from rigidpend.config import overrides, reader
from rigidpend.config.complaints import ConfigError
from rigidpend.config.overrides import Sweep
from rigidpend.runs import loading
from tests.config.samples import FIG4, SMALL, written


def test_every_combination_has_a_result_named_by_its_values() -> None:
    given = ["problem.mu=1e-4,1e-3", "problem.J1_0=1e-8,1e-6,1e-7"]
    [members] = loading.load_swept([FIG4], (), given)
    assert [member.name for member in members] == [
        f"fig4_mu={mu}_J1_0={J1_0}" for mu in ("1e-4", "1e-3") for J1_0 in ("1e-8", "1e-6", "1e-7")
    ]
    third = members[2].resolved()["problem"]
    assert (third["mu"], third["J1_0"]) == ("1/10000", "1/10000000")
    assert third["h0"] == loading.load(FIG4).resolved()["problem"]["h0"]


def test_lists_and_expressions_are_values_too_and_names_tell_them() -> None:
    found = overrides.option("problem.A=[2, 1, 1.5],[3, 2, 2.5]")
    assert found[:2] == Sweep("problem.A", ("[2, 1, 1.5]", "[3, 2, 2.5]"))[:2]
    data = {"a": (1, 2.5, True, None), "b": {"c": "x"}}
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


@pytest.mark.parametrize(
    ("option", "said"),
    [
        ("problem.mu", "--sweep problem.mu: expected KEY.KEY=VALUE,VALUE"),
        ("problem.mu=1", "a sweep of problem.mu needs two values or more"),
        ("problem.mu=1,1", "the value 1 is given twice"),
        ("problem.mu=1,[2", "--sweep problem.mu=1,[2: not YAML"),
        (
            "problem.mu=1/2,1over2",
            "problem.mu=1/2 and problem.mu=1over2 would have the same name _mu=1over2",
        ),
        (f"problem.mu={0.5:.160f},0.1", "a name is made of up to 150 letters"),
        ("problem.mew=1,2", "--sweep problem.mew=1,2: problem.mew: unknown key (known: A, r, mu"),
        ("problem.mu=1e-4,5", "h0 > mu is broken"),
        ("problem.mu=" + ",".join(map(str, range(1001))), "more than 1000 combinations"),
    ],
)
def test_what_is_wrong_with_a_sweep_is_named(option: str, said: str) -> None:
    with pytest.raises(ConfigError) as caught:
        loading.load_swept([FIG4], (), [option])
    assert said in str(caught.value)


NO_NAMES = ("", "a/b", "../x", "all", ".hidden", "x" * 200, "a\nb")
TAKEN = ("fig5.certificate", "Fig5.Certificate")
NAMES = dict.fromkeys(NO_NAMES, "a name is made of")
NAMES |= dict.fromkeys(TAKEN, "--name: choose another name than")
NAMES |= dict.fromkeys(("console", "nulls", "fig5.certificates", "a.b", "lpt"), "")


@pytest.mark.parametrize("name", NAMES)
def test_a_name_that_is_no_file_s_or_of_something_else_is_refused(
    tmp_path: Path, name: str
) -> None:
    """One that only begins like such a name is free."""
    if not NAMES[name]:
        [[member]] = loading.load_swept([FIG4], name=name)
        assert member.name == name
        return
    with pytest.raises(ConfigError, match=NAMES[name]):
        loading.load_swept([FIG4], name=name)
    if name in TAKEN:
        # A file's name becomes that of its result.
        with pytest.raises(ConfigError, match="choose another name than"):
            loading.load(written(tmp_path, SMALL, f"{name}.yaml"))


def test_the_file_of_a_sweep_is_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    read = Mock(wraps=reader.read)
    monkeypatch.setattr(reader, "read", read)
    values = ",".join(f"{k}e-7" for k in range(1, 41))
    [members] = loading.load_swept([FIG4], (), [f"problem.mu={values}"])
    assert {member.content.figure for member in members} == {""}
    # Once for the sweep, and at most once more to learn which figure of the paper it was.
    assert len(members) == 40
    assert read.call_count <= 2
