"""Which engine serves, what is refused, and that no result depends on `jobs`."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import EngineError, engines
from rigidpend.orbits.integrate.arithmetic import resolve
from tests.orbits.integrate.problems import (
    fan,
    find,
    needs_heyoka,
    same,
)


@pytest.fixture
def without(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Lets a package seem not to be installed."""

    def hide(package: str) -> None:
        genuine = engines._installed
        monkeypatch.setattr(engines, "_installed", lambda name: name != package and genuine(name))

    return hide


def test_engine_falls_back_to_scipy_without_a_compiler(without: Callable[[str], None]) -> None:
    without("llvmlite")
    assert integrate.default_engine() == "scipy"
    assert integrate.check_engine("scipy") == "scipy"
    with pytest.raises(EngineError, match=r"'taylor' needs the package llvmlite.*choose 'scipy'"):
        integrate.check_engine("taylor")


def test_engine_taylor_needs_no_heyoka_for_doubles_and_pairs(
    without: Callable[[str], None],
) -> None:
    without("heyoka")
    assert integrate.default_engine() == integrate.check_engine("taylor") == "taylor"
    offered = [integrate.has_own_type("taylor", bits) for bits in (53, 64, 106, 113, 160)]
    assert offered == [True, True, True, False, False]
    assert resolve(None, None, (53, 64, 106)).precisions == (53, 64, 106)


def test_what_is_slow_without_heyoka_is_told_with_what_to_do(
    without: Callable[[str], None],
) -> None:
    without("heyoka")
    told = engines.slow_precisions("taylor", (53, 106, 160))
    assert "160 bits" in told
    assert "106" not in told
    assert "conda install -c conda-forge heyoka.py" in told
    assert engines.slow_precisions("taylor", (53, 106)) == ""
    assert engines.slow_precisions("scipy", (53, 160)) == "", "with it too"


@needs_heyoka("where it is")
def test_nothing_is_said_to_be_slow_with_heyoka() -> None:
    assert engines.slow_precisions("taylor", (53, 106, 160)) == ""
    assert engines.slow_precisions("scipy", (53, 160)) == ""


def test_engine_refuses_an_unknown_name() -> None:
    with pytest.raises(EngineError, match="'euler' is not known; choose one of taylor, scipy"):
        integrate.sample(lambda x, m: x, [1.0], [0.0, 1.0], engine="euler")


def test_engine_scipy_has_doubles_only() -> None:
    assert [integrate.has_own_type("scipy", bits) for bits in (53, 64, 113)] == [True, False, False]


@needs_heyoka("where it is")
def test_engine_taylor_has_every_precision_above_113_bits() -> None:
    offered = [integrate.has_own_type("taylor", bits) for bits in (53, 80, 106, 113, 114, 200)]
    assert offered == [True] * 6


@pytest.mark.slow
@needs_heyoka("heyoka's numbers against integers")
@pytest.mark.parametrize("bits", [160, 240])
def test_agrees_arbitrary_precision_with_integers_to_the_last_bit(bits: int) -> None:
    begin = fan(1, J1=1e-12)
    integers, heyoka = (find(begin, way, bits, n_crossings=2) for way in ("scipy", "taylor"))
    assert same(integers, heyoka)


def test_jobs_change_no_bit_of_a_batch() -> None:
    """Orbits longer than the passage limit, in other company for each number of jobs."""
    states = fan(21)
    alone = find(states, "taylor", n_crossings=9, passage_limit=40)
    for jobs in (2, 3, 50):
        found = find(states, "taylor", n_crossings=9, passage_limit=40, jobs=jobs)
        assert same(alone, found)


@pytest.mark.slow
@needs_heyoka("its real128")
def test_jobs_change_no_bit_of_real128() -> None:
    states = fan(3)
    alone = find(states, "taylor", 113)
    assert all(same(alone, find(states, "taylor", 113, jobs=jobs)) for jobs in (2, 3))


@pytest.mark.slow
def test_jobs_change_no_bit_of_scipy() -> None:
    """70 orbits make two parts, which go to two processes."""
    states = fan(70)
    alone = find(states, "scipy", n_crossings=1)
    assert same(alone, find(states, "scipy", n_crossings=1, jobs=2))


@pytest.mark.slow
def test_jobs_change_no_bit_of_the_integers() -> None:
    states = fan(3)
    alone = find(states, "scipy", 80, n_crossings=2)
    assert same(alone, find(states, "scipy", 80, n_crossings=2, jobs=2))
