"""No symbol that is called certain is wrong: random phases against 113 bits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend import RouteCodes, route_codes
from rigidpend.routes.certainty import LINEAR
from tests.routes.reference import random_phases

pytestmark = pytest.mark.slow


def computed(J1_0: str, every: int = 1, **numerics: Any) -> tuple[RouteCodes, Any, Any]:
    """Routes, where they are wrong, and the errors of their last times."""
    reference, how = random_phases(J1_0), {"method": "integration", "jobs": 2, **numerics}
    phases = np.array(reference.theta2_0)[::every]
    found = route_codes(reference.body, phases, h0=reference.h0, J1_0=J1_0, **how)
    late = np.abs(found.crossing_time[-1] - reference.crossing_time[-1, ::every])
    return found, found.codes != reference.codes[:, ::every], late


# Two maps leave one orbit in seven to the next precision.
@pytest.mark.parametrize(("method", "share"), [("integration", 0.9), ("map", 0.85)])
@pytest.mark.parametrize("J1_0", ["1e-6", "1e-10"])
def test_certain_is_every_symbol_and_right(J1_0: str, method: str, share: float) -> None:
    found, wrong, _ = computed(J1_0, 4 if method == "integration" else 1, method=method)
    assert found.certain.all()
    assert not wrong.any()
    assert (found.bits == 53).mean() > share, "doubles are enough for most"


@pytest.mark.parametrize("J1_0", ["1e-6", "1e-10"])
def test_certain_in_doubles_alone_is_never_wrong(J1_0: str) -> None:
    found, wrong, late = computed(J1_0, 2, precisions=(53,))
    assert not (wrong & found.certain).any()
    assert 0 < (~found.certain).sum() < 150, "some are known to be unknown"
    # A column that is certain to its end has times as good as the rule says.
    assert late[found.certain[-1]].max() < LINEAR / 2


def test_certain_is_never_wrong_though_the_tolerance_is_coarse() -> None:
    found, wrong, _ = computed("1e-6", 2, precisions=(53,), tolerance=1e-6)
    assert not (wrong & found.certain).any()
    assert found.certain[0].mean() > 0.9, "the first symbols are easy"
    assert wrong.any(), "else this test shows nothing"
