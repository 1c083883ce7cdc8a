"""No symbol that is called certain is wrong: 4000 random phases against 113 bits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend import RouteCodes, route_codes
from rigidpend.routes.certainty import LINEAR
from tests.routes.reference import random_phases

J1_0S = ["1e-6", "1e-10"]


def computed(J1_0: str, method: str = "integration", **numerics: Any) -> RouteCodes:
    reference = random_phases(J1_0)
    return route_codes(
        reference.body,
        np.array(reference.theta2_0),
        h0=reference.h0,
        J1_0=J1_0,
        engine="taylor",
        method=method,
        jobs=2,
        **numerics,
    )


def wrong(found: RouteCodes, J1_0: str) -> Any:
    return found.codes != random_phases(J1_0).codes


# Two maps leave one orbit in seven to the next precision.
@pytest.mark.slow
@pytest.mark.parametrize(("method", "share"), [("integration", 0.9), ("map", 0.85)])
@pytest.mark.parametrize("J1_0", J1_0S)
def test_certain_is_every_symbol_and_right(J1_0: str, method: str, share: float) -> None:
    found = computed(J1_0, method)
    assert found.codes.shape == (15, 2000)
    assert found.certain.all()
    assert not wrong(found, J1_0).any()
    assert (found.bits == 53).mean() > share, "doubles are enough for most"


@pytest.mark.slow
@pytest.mark.parametrize("J1_0", J1_0S)
def test_certain_in_doubles_alone_is_never_wrong(J1_0: str) -> None:
    found = computed(J1_0, precisions=(53,))
    assert not (wrong(found, J1_0) & found.certain).any()
    assert 0 < (~found.certain).sum() < 300, "some are known to be unknown"
    # A column that is certain to its end has times as good as the rule says.
    error = np.abs(found.crossing_time[-1] - random_phases(J1_0).crossing_time[-1])
    assert error[found.certain[-1]].max() < LINEAR / 2


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-8, 1e-6])
def test_certain_is_never_wrong_though_the_tolerance_is_coarse(tolerance: float) -> None:
    mistakes = 0
    for J1_0 in J1_0S:
        found = computed(J1_0, precisions=(53,), tolerance=tolerance)
        mistakes += int(wrong(found, J1_0).sum())
        assert not (wrong(found, J1_0) & found.certain).any()
        assert found.certain[0].mean() > 0.9, "the first symbols are easy"
    assert mistakes > 0, "else this test shows nothing"
