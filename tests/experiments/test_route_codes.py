"""The experiment `route_codes`: it is the function of that name, and it knows two results apart."""

import copy
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend.experiments.contract import Piece
from rigidpend.experiments.route_codes import compute as route_codes
from rigidpend.machine.progress import PartDone
from rigidpend.numbers.texts import NO_SYMBOL
from rigidpend.orbits.integrate.arithmetic import DEFAULT_ENGINE, resolve
from rigidpend.routes.codes import route_codes as compute_codes
from rigidpend.routes.problem import RouteProblem
from rigidpend.runs import loading
from rigidpend.surfaces import melnikov
from tests.config.samples import SMALL, written
from tests.experiments.trees import computed, differences

SECOND = "problem.arrays.second={start: 3*pi/40, step: 1/100, count: 2}"

Data = dict[str, dict[str, Any]]


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> Any:
    path = written(tmp_path_factory.mktemp("config"), SMALL)
    return loading.load(path, [SECOND, "problem.n_symbols=5"]).content


@pytest.fixture(scope="module")
def reported() -> list[str]:
    return []


def result(content: Any, **means: Any) -> Data:
    """What is computed, whatever numerics the config asks for."""
    return computed(content, **{"arithmetic": resolve(DEFAULT_ENGINE), **means})


@pytest.fixture(scope="module")
def data(content: Any, reported: list[str]) -> Data:
    """The arrays of a result, of which each test changes a copy."""
    return result(content, report=reported.append)


def test_each_array_is_route_codes_with_melnikov_s_zeros(
    content: Any, data: Data, reported: list[str]
) -> None:
    p, phases = content.problem, [f"3*pi/40 + {k}/100" for k in range(2)]
    given: Any = {"h0": "1.3342", "J1_0": "1e-8", "n_symbols": 5, "precisions": (53,)}
    expected = compute_codes(p.body, phases, **given)._asdict()
    assert not expected.pop("by_map").any(), "few orbits are integrated"
    zeros = melnikov.zeros(RouteProblem(p.body, p.h0, p.J1_0, 5))
    assert list(data) == ["only", "second"]
    np.testing.assert_equal(data["second"], expected | {"melnikov_zeros": zeros})
    assert reported == ["only: 5 orbits, 5 in 53 bits", "second: 2 orbits, 2 in 53 bits"]


def test_orbits_share_the_processes_that_a_run_may_take(
    content: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And a part of them is decided as all would be."""
    stop = Mock(side_effect=InterruptedError)
    monkeypatch.setattr(route_codes, "codes_of", stop)
    monkeypatch.setattr(route_codes, "expected_seconds", lambda _, n, *__: 10.1 * n)
    with pytest.raises(InterruptedError):
        result(content, jobs=3)
    assert (len(stop.call_args.args[1]), stop.call_args.args[3]) == (1, 3)
    assert stop.call_args.kwargs == {"task_orbits": 5}


def test_a_symbol_may_differ_where_it_was_uncertain_and_nowhere_else(data: Data) -> None:
    other = copy.deepcopy(data)
    other["only"]["codes"][2, 1] ^= 1
    [found] = differences("route_codes", data, other)
    assert found == f"only/codes[2, 1]: stored {1 - found.computed}, computed {found.computed}"
    other["only"]["certain"][2:, 1] = False
    assert differences("route_codes", other, data) == []
    lost = "only/certain[2, 1]: stored True, computed False (3 of 25 differ)"
    assert differences("route_codes", data, other) == [lost]
    # Symbol 3, in row 2, is what happens between the crossings 2 and 3 of rows 2 and 3.
    for field in ("crossing_time", "separatrix"):
        for row, count in ((3, 0), (2, 1)):
            changed = copy.deepcopy(other)
            changed["only"][field][row, 1] += 1
            assert len(differences("route_codes", changed, data)) == count
            first, *more = differences("route_codes", data, changed)
            assert first == lost
            assert [field in text for text in more] == [True] * count


@pytest.mark.parametrize(
    ("seconds", "sizes"), [(1.9, [2, 2, 1]), (0.6, [3, 2]), (10.1, [1] * 5), (0.1, [4, 1])]
)
def test_parts_take_some_seconds_and_are_the_array(
    content: Any, data: Data, monkeypatch: pytest.MonkeyPatch, seconds: float, sizes: list[int]
) -> None:
    """Of five columns: two at least, but where each takes long, and four at most."""
    parts: dict[str, Any] = {}

    def pieces(several: Sequence[Piece]) -> Iterator[Any]:
        parts.update({each.name: each.compute() for each in several})
        return (parts[each.name] for each in several)

    monkeypatch.setattr(route_codes, "LANES", 2)
    monkeypatch.setattr(route_codes, "MOST", 4)
    monkeypatch.setattr(route_codes, "expected_seconds", lambda _, n, *__: seconds * n)
    made = result(content, pieces=pieces)
    assert [len(x["bits"]) for name, x in parts.items() if name.startswith("only.")] == sizes
    np.testing.assert_equal(made["only"]["codes"], data["only"]["codes"])
    np.testing.assert_equal(made["only"]["theta2_0"], data["only"]["theta2_0"])


def test_progress_is_a_share_of_the_orbits_of_all_arrays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    third = SECOND.replace("second", "third")
    path = written(tmp_path, SMALL)
    content = loading.load(path, [SECOND, third, "problem.n_symbols=2"]).content
    heard: list[Any] = []
    monkeypatch.setattr(route_codes, "PART", 0.0)
    monkeypatch.setattr(route_codes, "LANES", 1)
    result(content, report=heard.append)
    shares = {str(line): line.share for line in heard if isinstance(line, PartDone)}
    assert shares["only: 3 of 5 orbits"] == 3 / 9
    assert shares["second: 1 of 2 orbits"] == 6 / 9
    assert shares["third: 1 of 2 orbits"] == 8 / 9


def test_long_passages_are_told_before_they_begin(
    content: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    monkeypatch.setattr(route_codes, "LONG", 1)
    result(content, report=said.append)
    assert said[0].startswith("passages are long: about ")
    assert "rotations of the pendulum each; some " in said[0]


@pytest.mark.slow
def test_what_maps_decided_is_told_where_there_was_a_choice(
    content: Any, data: Data, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rigidpend.routes.costs.LEAST_SECONDS", 0.0)
    monkeypatch.setattr("rigidpend.routes.costs.budget", lambda *_: float("inf"))
    mapped = result(content, arithmetic=resolve(DEFAULT_ENGINE, None, (53,)))
    assert mapped["only"]["by_map"].all()
    assert differences("route_codes", data, mapped) == []


@pytest.mark.parametrize(
    ("stay", "said"), [(1, "0"), (5, "0, 1, 2, 3, 4"), (7, "0, 1, 2, 3, 4 and 2 more")]
)
def test_of_orbits_that_stay_five_are_named(content: Any, stay: int, said: str) -> None:
    def pieces(several: Sequence[Piece]) -> Iterator[Any]:
        for one in several:
            whole = one.compute()
            made = {name: np.take(x, np.arange(8) % 2, axis=-1) for name, x in whole.items()}
            made["codes"][1, :stay] = NO_SYMBOL
            yield made | {"theta2_0": np.arange(8.0), "by_map": np.arange(8) == 3}

    told: list[str] = []
    found = result(content, pieces=pieces, report=told.append)
    assert found["only"]["by_map"].sum() == 1, "one that maps found is told of"
    assert told[0].endswith(f"; {stay} stay beside a pendulum motion: theta2_0 = {said}")
