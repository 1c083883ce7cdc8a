"""The experiment `route_codes`: it is the function of that name, and it knows two results apart."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.contract import Means
from rigidpend.experiments.route_codes import compute as route_codes
from rigidpend.experiments.route_layout import crossing_tolerance
from rigidpend.numbers.alphabet import NO_SYMBOL
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.integrate.engines import default_engine
from rigidpend.routes.codes import route_codes as compute_codes
from rigidpend.routes.costs import integration
from rigidpend.routes.problem import RouteProblem
from rigidpend.runs import loading
from rigidpend.surfaces import melnikov
from tests.config.samples import SMALL, written
from tests.experiments.trees import differences, plain, with_change

FIG4 = Path(__file__).resolve().parents[3] / "configs" / "fig4.yaml"
SECOND = "problem.arrays.second={start: 3*pi/40, step: 1/100, count: 2}"

Data = dict[str, dict[str, Any]]


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A checked config of two arrays."""
    path = written(tmp_path_factory.mktemp("config"), SMALL)
    return loading.load(path, [SECOND, "problem.n_symbols=5"]).content


@pytest.fixture(scope="module")
def reported() -> list[str]:
    return []


@pytest.fixture(scope="module")
def tree(content: Any, reported: list[str]) -> Any:
    return route_codes.compute(content, Means(resolve(default_engine()), 1, reported.append))


@pytest.fixture
def data(tree: Any) -> Data:
    """The arrays of a result, each test's own."""
    return plain(tree)


def test_compute_is_route_codes_of_each_array(content: Any, tree: Any) -> None:
    assert list(tree) == ["only", "second"]
    p = content.problem
    phases = {
        "only": [f"1 + {k}/10" for k in range(5)],
        "second": [f"3*pi/40 + {k}/100" for k in range(2)],
    }
    for name, group in tree.items():
        routes = compute_codes(
            p.body, phases[name], h0="1.3342", J1_0="1e-8", n_symbols=5, precisions=(53,)
        )
        assert not routes.by_map.any(), "few orbits are integrated"
        for field, expected in routes._asdict().items():
            if field == "by_map":
                continue
            np.testing.assert_array_equal(group[field].values, expected, err_msg=field)
            assert group[field].values.dtype == expected.dtype
        assert routes.certain.all()


def test_compute_adds_the_melnikov_zeros_to_each_array(content: Any, tree: Any) -> None:
    p = content.problem
    zeros = melnikov.zeros(RouteProblem(p.body, p.h0, p.J1_0, 5))
    for group in tree.values():
        np.testing.assert_array_equal(group["melnikov_zeros"].values, zeros)


def test_compute_reports_each_array(tree: Any, reported: list[str]) -> None:
    assert reported == ["only: 5 orbits, 5 in 53 bits", "second: 2 orbits, 2 in 53 bits"]


def test_orbits_that_stay_are_named(tmp_path: Path) -> None:
    """Beside an elliptic periodic orbit: its multipliers have the sum -1.27."""
    settings = ["problem.A=[2.344,1.144,1.275]", "problem.r=[0.645,0.764,0]", "problem.h0=1"]
    settings += ["problem.mu=0.758", "problem.J1_0=1e-4", "problem.arrays.only.start=0"]
    said: list[str] = []
    content: Any = loading.load(written(tmp_path, SMALL), settings).content
    data = plain(route_codes.compute(content, Means(resolve(default_engine()), 1, said.append)))
    only = data["only"]
    stay = only["theta2_0"][(only["codes"] == NO_SYMBOL).any(axis=0)]
    assert stay.size
    phases = ", ".join(f"{x:.6g}" for x in stay)
    assert f"; {stay.size} stay beside a pendulum motion: theta2_0 = {phases}" in said[-1]


def test_numerics_reach_the_computation(content: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Any] = []

    def stop(*given: Any, **_: Any) -> Any:
        seen.append(given)
        raise InterruptedError

    monkeypatch.setattr(route_codes, "codes_of", stop)
    arithmetic = resolve("scipy", 1e-9, (60, 80))
    with pytest.raises(InterruptedError):
        route_codes.compute(content, Means(arithmetic, 3, print))
    [(problem, _, *numerics)] = seen
    assert problem is content.problem.routes
    assert numerics == [arithmetic, 3]


def flip(data: Data) -> None:
    data["only"]["codes"][2, 1] ^= 1


def doubt(data: Data) -> None:
    flip(data)
    data["only"]["certain"][2:, 1] = False


def test_a_certain_symbol_that_changed_is_found(data: Data) -> None:
    [found] = differences("route_codes", data, with_change(data, flip))
    assert found == f"only/codes[2, 1]: stored {1 - found.computed}, computed {found.computed}"


LOST = "only/certain[2, 1]: stored True, computed False (3 of 25 differ)"


def test_a_symbol_that_was_uncertain_may_differ(data: Data) -> None:
    assert differences("route_codes", with_change(data, doubt), data) == []


def test_symbols_that_are_no_longer_certain_are_found_and_no_more_of_them(data: Data) -> None:
    assert differences("route_codes", data, with_change(data, doubt)) == [LOST]


@pytest.mark.parametrize("field", ["crossing_time", "separatrix"])
def test_what_is_compared_ends_before_the_first_uncertain_symbol(data: Data, field: str) -> None:
    def change(row: int) -> Callable[[Data], None]:
        def changed(data: Data) -> None:
            doubt(data)
            data["only"][field][row, 1] += 1

        return changed

    # Symbol 3, in row 2, is what happens between the crossings 2 and 3 of rows 2 and 3.
    for row, count in ((2, 1), (3, 0)):
        assert len(differences("route_codes", with_change(data, change(row)), data)) == count
        lost, *found = differences("route_codes", data, with_change(data, change(row)))
        assert lost == LOST
        assert len(found) == count
        assert all(field in text for text in found)


def test_a_crossing_time_may_differ_by_what_its_arithmetic_explains(data: Data) -> None:
    def change(data: Data) -> None:
        data["only"]["crossing_time"] += 0.5 * crossing_tolerance(6)

    assert differences("route_codes", data, with_change(data, change)) == []


def test_other_numbers_of_symbols_or_columns_are_found(data: Data) -> None:
    def change(data: Data) -> None:
        for field in data["only"]:
            data["only"][field] = data["only"][field][..., :2]

    [found] = differences("route_codes", data, with_change(data, change))
    assert found == "only/theta2_0: shape (5,) stored, (2,) computed"


@pytest.mark.parametrize("absent_first", [True, False])
def test_a_certain_crossing_without_a_time_is_found(data: Data, absent_first: bool) -> None:
    def change(data: Data) -> None:
        data["only"]["crossing_time"][0, 0] = np.nan

    pair = [with_change(data, change), data]
    if not absent_first:
        pair.reverse()
    [found] = differences("route_codes", *pair)
    assert found.startswith("only/crossing_time[0, 0]: stored ")
    assert "nan" in found
    assert differences("route_codes", with_change(data, change), with_change(data, change)) == []


def test_an_array_in_parts_is_the_array_at_once(
    content: Any, tree: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each part has columns of its own: of five columns in parts of two, and one alone."""
    monkeypatch.setattr(route_codes, "LANES", 2)
    monkeypatch.setattr(route_codes, "PART", 0.0)
    kept: list[str] = []

    def part(name: str, compute: Callable[[], Any]) -> Any:
        kept.append(name)
        return compute()

    means = Means(resolve(default_engine()), 1, lambda _: None, part)
    made: Any = route_codes.compute(content, means)
    assert kept == ["only.00000000", "only.00000002", "only.00000004", "second.00000000"]
    for name, group in tree.items():
        for field in ("theta2_0", "codes", "certain", "separatrix"):
            found = made[name][field].values
            np.testing.assert_array_equal(found, group[field].values, err_msg=field)
    assert len(set(made["only"]["theta2_0"].values)) == 5


def test_parts_that_were_kept_may_be_of_another_size(
    content: Any, tree: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(route_codes, "PART", 0.0)
    kept: dict[str, Any] = {}

    def part(name: str, compute: Callable[[], Any]) -> Any:
        return kept.setdefault(name, compute()) if name not in kept else kept[name]

    means = Means(resolve(default_engine()), 1, lambda _: None, part)
    monkeypatch.setattr(route_codes, "LANES", 3)
    route_codes.compute(content, means)
    # Of the first run the first part is left, and another machine takes smaller ones.
    del kept["only.00000003"]
    monkeypatch.setattr(route_codes, "LANES", 1)
    made: Any = route_codes.compute(content, means)
    assert {"only.00000000", "only.00000003", "only.00000004"} < set(kept)
    for field in ("theta2_0", "codes", "certain", "separatrix"):
        found = made["only"][field].values
        np.testing.assert_array_equal(found, tree["only"][field].values, err_msg=field)


def test_long_passages_are_told_before_they_begin(
    content: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    monkeypatch.setattr(route_codes, "LONG", 1)
    means = Means(resolve(default_engine()), 1, said.append)
    route_codes.compute(content, means)
    assert said[0].startswith("passages are long: about ")
    assert "rotations of the pendulum each; some " in said[0]


def test_crossing_times_may_differ_by_a_declared_bound_that_no_setting_moves() -> None:
    """In t', from the differences measured between builds: see `crossing_tolerance`."""
    allowed = crossing_tolerance(16)[:, 0]
    assert allowed[:4].tolist() == pytest.approx([1e-12, 1e-8, 3.5e-8, 1.225e-7])
    assert allowed[-1] == 0.02
    # The largest difference measured at the sixteenth crossing.
    assert 5e-4 < allowed[15] < 100 * 5e-4


def test_the_bound_on_crossing_times_has_a_value_for_the_longest_routes() -> None:
    """Its growth alone would have no double after some 560 crossings."""
    allowed = crossing_tolerance(100_001)[:, 0]
    assert allowed[0] == 1e-12
    assert allowed[1] == pytest.approx(1e-8, rel=1e-14)
    assert allowed[2] == pytest.approx(3.5e-8, rel=1e-14)
    assert (allowed[16:] == 0.02).all()
    assert (np.diff(allowed) >= 0).all()


def test_what_maps_decided_is_told_where_there_was_a_choice(
    content: Any, tree: Any, data: Data, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "by_map" not in tree["only"]
    monkeypatch.setattr("rigidpend.routes.costs.LEAST", 0.0)
    monkeypatch.setattr("rigidpend.routes.costs.budget", lambda *_: float("inf"))
    means = Means(resolve(default_engine(), None, (53,)))
    mapped: Any = route_codes.compute(content, means)
    assert mapped["only"]["by_map"].values.all()
    fresh = {
        name: {field: np.array(dataset.values) for field, dataset in group.items()}
        for name, group in mapped.items()
    }
    assert differences("route_codes", data, fresh) == []


def test_an_estimate_counts_the_bits_that_long_codes_take() -> None:
    """63 and 32 columns; of 15 symbols doubles decide most, of 5,000 no bits are enough."""

    def seconds(*settings: str) -> float:
        content: Any = loading.load(FIG4, list(settings)).content
        return route_codes.cost(content)

    doubles = "numerics.precisions=[53]"
    assert seconds("problem.n_symbols=15") < 1.2 * seconds("problem.n_symbols=15", doubles)
    content: Any = loading.load(FIG4).content
    each = integration(replace(content.problem.routes, n_symbols=300), (53, 106))
    assert seconds("problem.n_symbols=300", "numerics.precisions=[53, 106]") == pytest.approx(
        route_codes.BEGIN + 95 * each / 2, rel=0.01
    )
    assert seconds("problem.n_symbols=5000") > 60 * seconds("problem.n_symbols=5000", doubles)
