"""The same symbols and certainty whatever long doubles there are."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from rigidpend.orbits.return_map.precision import precision
from rigidpend.routes.codes import RouteCodes, route_codes
from tests.orbits.integrate.problems import FIG4

PHASES = np.random.default_rng(7).uniform(0, 6.28, 120)


@pytest.fixture
def without_long_doubles(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Lets a long double be a double for whoever asks."""
    numbers = np.finfo
    monkeypatch.setattr(np, "finfo", lambda kind: numbers(float if kind is np.longdouble else kind))
    precision.cache_clear()
    yield
    precision.cache_clear()


def found(method: str, **more: Any) -> RouteCodes:
    task: dict[str, Any] = {"h0": "1.3342", "J1_0": "1e-8", "n_symbols": 24, **more}
    return route_codes(FIG4, PHASES, method=method, precisions=(53, 64), **task)


@pytest.fixture(scope="module", params=["map", "integration"])
def given(request: pytest.FixtureRequest) -> tuple[str, RouteCodes]:
    return request.param, found(request.param)


@pytest.mark.slow
@pytest.mark.usefixtures("without_long_doubles")
def test_symbols_and_certainty_need_no_long_doubles(
    given: tuple[str, RouteCodes],
) -> None:
    method, expected = given
    again = found(method)
    assert (again.bits == 64).sum() > 3, "some need more than doubles"
    np.testing.assert_array_equal(again.codes, expected.codes)
    np.testing.assert_array_equal(again.certain, expected.certain)
    np.testing.assert_array_equal(again.bits, expected.bits)
