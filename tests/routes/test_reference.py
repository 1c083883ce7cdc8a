"""No symbol that is called certain is wrong.

Against 113 bits computed without this package, and the first against Melnikov's function.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from rigidpend import Body, RouteCodes, route_codes
from rigidpend.routes.certainty import LINEAR
from tests.bodies import FIG4, GENERIC
from tests.routes.reference import Reference, fig4_left, random_phases, vertex_theta1

BOTH = pytest.mark.parametrize("J1_0", ["1e-6", "1e-10"])


def computed(of: Reference, every: int = 1, **numerics: Any) -> tuple[RouteCodes, Any, Any]:
    """Routes, where they are wrong, and the errors of their times."""
    how: dict[str, Any] = {"h0": of.h0, "J1_0": of.J1_0, "jobs": 2, **numerics}
    found = route_codes(of.body, of.theta2_0[::every], **how)
    late = np.abs(found.crossing_time[-len(of.crossing_time) :] - of.crossing_time[:, ::every])
    return found, found.codes != of.codes[:, ::every], late


def test_agrees_every_cell_of_fig_4_s_left_array_and_all_are_certain() -> None:
    left = fig4_left()
    found, wrong, late = computed(left)
    assert wrong.size == 945
    assert found.certain.all()
    assert not wrong.any()
    assert (found.bits == 53).mean() > 0.6
    # What went up in precision is known to what the threshold there allows, and better.
    assert late.max() < 1e-3
    # The first passage knows no chaos yet.
    assert late[0].max() < 1e-10
    # theta1 lies on the separatrix that is named.
    distance = left.theta1 - vertex_theta1(found.separatrix)
    assert np.abs((distance + 2 * np.pi) % (4 * np.pi) - 2 * np.pi).max() < 0.01


@pytest.mark.slow
# Two maps leave one orbit in seven to the next precision.
@pytest.mark.parametrize(("method", "share"), [("integration", 0.9), ("map", 0.85)])
@BOTH
def test_certain_is_every_symbol_and_right(J1_0: str, method: str, share: float) -> None:
    every = 4 if method == "integration" else 1
    found, wrong, _ = computed(random_phases(J1_0), every, method=method)
    assert found.certain.all()
    assert not wrong.any()
    assert (found.bits == 53).mean() > share, "doubles are enough for most"


@pytest.mark.slow
@BOTH
def test_certain_in_doubles_alone_is_never_wrong(J1_0: str) -> None:
    given: dict[str, Any] = {"method": "integration", "precisions": (53,)}
    found, wrong, late = computed(random_phases(J1_0), 2, **given)
    assert not (wrong & found.certain).any()
    assert 0 < (~found.certain).sum() < 150, "some are known to be unknown"
    # A column that is certain to its end has times as good as the rule says.
    assert late[-1, found.certain[-1]].max() < LINEAR / 2
    if J1_0 == "1e-6":
        found, wrong, _ = computed(random_phases(J1_0), 2, **given, tolerance=1e-6)
        assert not (wrong & found.certain).any()
        assert found.certain[0].mean() > 0.9, "the first symbols are easy"
        assert wrong.any(), "else this test shows nothing"


@pytest.mark.parametrize("mu", ["1e-3", "1e-4"])
@pytest.mark.parametrize("body", [FIG4, GENERIC], ids=["Fig. 4", "generic"])
def test_the_first_symbol_is_the_sign_of_melnikov_s_function(body: Body, mu: str) -> None:
    """Of (Im), up to O(mu) beside its zeros."""
    # delta of (Im), where its argument is theta2_0: v = ln((J2_0 - J1_0)/J1_0).
    v = math.log((math.sqrt(2 * 1.3342 / body.kappa) - 1e-8) / 1e-8)
    delta = (body.alpha0 + body.beta0) / 2 + body.kappa * v / math.sin(body.alpha0)
    phases = np.arange(63) / 10 + 0.05
    melnikov = np.cos(delta + phases)
    assert (np.abs(melnikov) > 10 * float(mu)).all(), "the grid keeps off the zeros"
    found = route_codes(Body(body.A, body.r, mu), phases, h0="1.3342", J1_0="1e-8", n_symbols=1)
    assert found.certain.all()
    np.testing.assert_array_equal(found.codes[0], melnikov > 0)
