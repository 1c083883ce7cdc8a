"""The experiment `herpolhodes`: its routes, and those that are no result."""

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.herpolhodes import compute as herpolhodes
from rigidpend.routes.codes import codes_of
from tests.experiments.trees import asked, computed


@pytest.fixture(scope="module")
def content() -> Any:
    return asked("fig5")


def test_each_route_is_told_with_the_error_of_its_samples(content: Any) -> None:
    """That the routes are the published ones is told by the report, and tested there."""
    reported: list[str] = []
    data = computed(content, report=reported.append)
    starts = [f"{name}: {each['route']}, crossing times within " for name, each in data.items()]
    assert all(map(str.startswith, reported, starts))


def test_a_route_that_is_not_certain_or_is_left_is_no_result(
    content: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither one uncertain symbol, nor one that is missing."""

    def spoilt(field: str) -> Any:
        def compute(*given: Any, **named: Any) -> Any:
            made = codes_of(*given, **named)
            assert min(given[2].precisions) > 53, "the samples' error is told by more bits"
            getattr(made, field)[-1] = 0
            return made

        return compute

    for field, said in (("certain", "the route is not certain"), ("separatrix", "the orbit stays")):
        monkeypatch.setattr(herpolhodes, "codes_of", spoilt(field))
        with pytest.raises(ArithmeticError, match=rf"theta2_0 = 1\.02: {said}"):
            computed(content)
    monkeypatch.undo()
    monkeypatch.setattr(herpolhodes, "separatrices", lambda _: np.array([2, 1, 4, 3, 4, 3]))
    with pytest.raises(ArithmeticError, match=r"theta2_0 = 1\.02: .* leaves the route; take fewer"):
        computed(content)


@pytest.mark.parametrize("J1_0", ["1e-9", "0.05", "0.3", "0.6"])
def test_plateaus_are_those_of_theta3_wherever_on_separatrix_2_the_orbit_starts(J1_0: str) -> None:
    """Halfway between crossings, up to a hundredth of an increment."""
    settings = "problem.mu=1e-4", f"problem.J1_0={J1_0}", "problem.n_symbols=3"
    for case in computed(asked("fig5", *settings)).values():
        crossing = case["crossing_time"]
        halfway = np.searchsorted(case["t"], (crossing[1:] + crossing[:-1]) / 2)
        gap = np.abs(case["theta3"][halfway] - case["plateaus"][1:-1]).max()
        assert gap < 0.01 * np.abs(np.diff(case["plateaus"])).max()
