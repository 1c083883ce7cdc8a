"""Route codes of orbits of many bodies: each is that of its orbit alone, whatever shares it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend import Body, route_codes
from rigidpend.mechanics.body import BodyError
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.routes import certainty
from rigidpend.routes.bodies import cells_of_each
from rigidpend.routes.problem import RouteProblem, passage_limit, phase_rate
from rigidpend.routes.rows import cell_problem
from tests.orbits.integrate.problems import FIG4

N = 4
PROBLEM = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), N)
MU, H0 = np.array([1e-3, 2e-3, 1e-3, 2e-3, 1e-3]), np.array([1.1, 1.2, 1.9, 1.3, 1.4])
THETA2 = np.array([0.3, 1.2, 2.2, 3.1, 5.0])


def test_orbits_of_mixed_bodies_and_energies_have_their_own_codes() -> None:
    arithmetic = resolve(None, None, (53,))
    found = cells_of_each(PROBLEM, {"mu": MU, "h0": H0}, THETA2, arithmetic)
    assert (found.certain == N).all()
    assert not found.by_map.any()
    for k, (mu, h0) in enumerate(zip(MU.tolist(), H0.tolist(), strict=True)):
        body = Body((2, 1, "1.5"), (1, 1, 0), mu)
        alone = route_codes(body, [THETA2[k]], h0=h0, J1_0="1e-8", n_symbols=N)
        assert (alone.codes[:, 0] == found.codes[:, k]).all()


def test_agreement_is_held_against_the_fastest_and_the_wait_is_the_longest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[tuple[float, float]] = []
    real = certainty.decide

    def noted(compute: Any, n: int, rate: float, precisions: Any) -> Any:
        asked.append((rate, passage_limit(compute.__self__.run.problem, 53)))
        return real(compute, n, rate, precisions)

    monkeypatch.setattr(certainty, "decide", noted)
    cells_of_each(PROBLEM, {"h0": H0}, THETA2, resolve(None, None, (53,)))
    each = [cell_problem(PROBLEM, {"h0": h0}) for h0 in H0.tolist()]
    rates, waits = map(phase_rate, each), (passage_limit(problem, 53) for problem in each)
    assert asked == [(max(rates), max(waits))]


@pytest.mark.slow
def test_no_code_depends_on_the_processes() -> None:
    arithmetic = resolve(None, None, (53,))
    one, two = (
        cells_of_each(PROBLEM, {"mu": MU, "h0": H0}, THETA2, arithmetic, jobs) for jobs in (1, 2)
    )
    for a, b in zip(one, two, strict=True):
        assert np.array_equal(a, b)


def test_a_body_that_is_none_is_refused() -> None:
    arithmetic = resolve(None, None, (53,))
    with pytest.raises(BodyError, match="alpha0"):
        cells_of_each(PROBLEM, {"alpha0": np.array([4.0])}, THETA2[:1], arithmetic)
