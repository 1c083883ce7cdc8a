"""Which engine serves, what is refused, and that no result depends on `jobs`."""

from __future__ import annotations

from typing import Any

import pytest

from rigidpend.orbits.integrate import dop853
from rigidpend.orbits.integrate.arithmetic import EngineError, in_kernel, kernel_bits, resolve
from rigidpend.orbits.integrate.states import states_at
from tests.orbits.integrate.problems import fan, find, same


def test_the_kernel_serves_up_to_424_bits() -> None:
    asked = (53, 54, 64, 106, 107, 212, 424)
    assert [in_kernel("taylor", bits) for bits in (*asked, 425)] == [True] * 7 + [False]
    assert list(map(kernel_bits, asked)) == [53, 106, 106, 106, 212, 212, 424]
    assert resolve(None, None, (53, 64, 106)).precisions == (53, 64, 106)


def test_engine_scipy_has_doubles_only() -> None:
    assert not any(in_kernel("scipy", bits) for bits in (53, 64, 113))
    assert resolve("scipy", None, (53, 64, 106)).precisions == (53, 106)


def test_engine_refuses_an_unknown_name() -> None:
    with pytest.raises(EngineError, match="'euler' is not known; choose one of taylor, scipy"):
        states_at(lambda x, m: x, [1.0], [1.0], engine="euler")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("engine", "bits", "n", "n_crossings"),
    # Orbits longer than the limit, in other company; fours of doubles; two parts, which go to
    # two processes; integers.
    [("taylor", 53, 21, 9), ("taylor", 212, 19, 1), ("scipy", 53, 3, 1), ("scipy", 80, 2, 1)],
)
def test_jobs_change_no_bit(
    engine: str, bits: int, n: int, n_crossings: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dop853, "SIDE_BY_SIDE", 2)
    given: Any = {"n_crossings": n_crossings, "passage_limit": 40.0}
    alone = find(fan(n), engine, bits, **given)
    for jobs in (2, 3, 50) if engine == "taylor" else (2,):
        assert same(alone, find(fan(n), engine, bits, **given, jobs=jobs))
