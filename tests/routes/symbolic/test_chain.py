"""Chains of passages: their equations' derivatives, and orbits followed by the map itself."""

from __future__ import annotations

import numpy as np
import pytest

from rigidpend.orbits.return_map import SectionPoint, return_map
from rigidpend.routes.symbolic.chain import (
    NoOrbit,
    System,
    on_surface,
    signs_of,
)
from rigidpend.routes.symbolic.integrated import passages
from rigidpend.routes.symbolic.shortest import (
    INSIDE,
    exactly,
    path,
    shortest,
)
from rigidpend.routes.symbolic.tables import Level
from tests.orbits.integrate.problems import FIG4

H = 1.3342
SYMBOLS = np.array([0, 1, 1, 0, 0])
TURNS = (11, 10, 12, 11, 14)
CELLS = np.concatenate(([0], np.cumsum(TURNS)))


@pytest.fixture(scope="module")
def level() -> Level:
    return Level(return_map(FIG4, h=str(H)), H)


@pytest.mark.parametrize("upper", [True, False])
@pytest.mark.parametrize("rising", [True, False])
def test_slopes_of_crossings_are_their_differences(level: Level, rising: bool, upper: bool) -> None:
    """Of a passage past the lower orbit the angle changes its sign on the way to the tables."""
    random, step = np.random.default_rng(1), 1e-5
    I, phase = random.uniform(-0.9, 0.9, (2, 50)) * [[level.widest], [9]]
    sides = np.full(50, rising), np.full(50, upper)
    at = level.crossings(*sides, I, phase)
    for k, (dI, dphase) in enumerate(((step * level.widest, 0.0), (0.0, step))):
        ahead, back = (level.crossings(*sides, I + s * dI, phase + s * dphase) for s in (1, -1))
        for by, value in ((at.chi_by[k], "chi"), (at.d_by[k], "d")):
            change = (getattr(ahead, value) - getattr(back, value)) / (2 * (dI + dphase))
            np.testing.assert_allclose(by, change, rtol=1e-6, atol=1e-8 * np.abs(by).max() + 1e-10)


@pytest.mark.parametrize("kind", ["open", "ends on a surface", "closed"])
def test_the_jacobian_is_the_derivatives(level: Level, kind: str) -> None:
    n = 4 if kind == "closed" else 5
    begin = None if kind == "closed" else on_surface
    last = None if kind == "ends on a surface" else float(np.pi * CELLS[n])
    system = System(level, begin, signs_of(SYMBOLS[:n]), last)
    x = system.guess(np.pi * CELLS[: n + 1], 0.0) + 0.1
    _, matrix, _ = system.evaluated(x)
    for column in range(len(x)):
        step = np.zeros(len(x))
        step[column] = 1e-5
        change = system.evaluated(x + step)[0] - system.evaluated(x - step)[0]
        derivative = matrix.toarray()[:, column]
        if not begin:
            # The last row only leaves the first unknown alone.
            derivative[-1] = 0.0
        np.testing.assert_allclose(change / 2e-5, derivative, atol=1e-7)


def test_the_map_follows_a_chain(level: Level) -> None:
    chain = exactly(System(level, on_surface, signs_of(SYMBOLS)), 0, 0.0, TURNS).chain
    assert chain.residual < 1e-12
    for k, symbol in enumerate(SYMBOLS):
        point = SectionPoint(k % 2 == 0, chain.d[k : k + 1], chain.chi[k : k + 1])
        passed = level.map_level.passage(point)
        assert passed.symbol[0] == symbol
        assert passed.turned[0] == pytest.approx(chain.chi[k + 1] - chain.chi[k], abs=1e-9)
        assert passed.time[0] == pytest.approx(chain.time[k], abs=1e-9)


def test_integration_follows_every_passage(level: Level) -> None:
    chain = exactly(System(level, on_surface, signs_of(SYMBOLS)), 0, 0.0, TURNS).chain
    alone = passages(FIG4, level, chain)
    assert alone.right.all()
    assert np.abs(alone.late).max() < 1e-9
    wrong = passages(FIG4, level, chain._replace(I=-chain.I))
    assert not wrong.right.any()


def test_long_passages_end_in_the_middle_of_cells(level: Level) -> None:
    """Where no crossing disturbs the next, the surfaces meet at gamma3 = 0 alone."""
    chain = exactly(System(level, on_surface, signs_of(SYMBOLS)), 1, np.pi, (30,) * 5).chain
    np.testing.assert_allclose(chain.chi, np.pi * (1 + 30 * np.arange(6)), atol=1e-9)


def test_the_reversor_makes_of_a_chain_one_of_the_inverse(level: Level) -> None:
    """Read backward, the orbit of a palindrome of invariants is the orbit itself."""
    signs = np.array([1, -1, 1, 1, -1, 1])
    turns = (11, 12, 13, 13, 12, 11)
    system = System(level, on_surface, signs, None)
    cells = np.concatenate(([0], np.cumsum(turns)))
    chain = system.solved(system.guess(np.pi * cells, 0.0))
    np.testing.assert_allclose(chain.I, chain.I[::-1], rtol=1e-9)
    np.testing.assert_allclose(chain.chi + chain.chi[::-1], np.pi * float(cells[-1]), atol=1e-9)


def test_few_half_rotations_leave_room(level: Level) -> None:
    made = shortest(System(level, on_surface, signs_of(SYMBOLS)), 0, 0.0)
    assert np.abs(made.chain.chi / np.pi - made.cells).max() <= INSIDE
    # The splitting allows no shorter passage beside the surface.
    assert made.half_turns[0] >= level.half_turns(level.splitting) - 1


def test_too_few_half_rotations_end_in_a_fold(level: Level) -> None:
    cells = np.concatenate(([0], np.cumsum((11, 7, 12, 11, 14))))
    with pytest.raises(NoOrbit, match="Passage 2 is the shortest"):
        path(System(level, on_surface, signs_of(SYMBOLS)), cells, 0.0)
    with pytest.raises(NoOrbit, match="none exists: passage 2"):
        exactly(System(level, on_surface, signs_of(SYMBOLS)), 0, 0.0, (11, 5, 12, 11, 14))
