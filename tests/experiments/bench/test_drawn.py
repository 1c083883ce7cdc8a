"""Bodies drawn by lot for the benchmark."""

from __future__ import annotations

import numpy as np

from rigidpend.experiments.bench import drawn


def test_bodies_drawn_by_lot_are_the_same_ones_and_lie_in_the_domain() -> None:
    problems = drawn.drawn()
    assert problems == drawn.drawn(drawn.SEED, drawn.BODIES)
    assert problems[:3] == drawn.drawn(bodies=3)
    assert set(problems).isdisjoint(drawn.drawn(drawn.SEED + 1))
    weights = [float(p.body.mu) / float(p.h0) for p in problems]
    starts = [float(p.J1_0) for p in problems]
    assert 0.9e-4 < min(weights) < 3e-4
    assert 0.01 < max(weights) < 0.0202
    assert 0.9e-12 < min(starts) < 1e-11
    assert 1e-7 < max(starts) < 1.01e-6
    assert {p.n_symbols for p in problems} == {15}


def test_shapes_of_drawn_bodies_fill_what_bodies_may_have() -> None:
    """Evenly over a triangle: each of the four equal ones into which it falls has its share."""
    shares = [[float(x) / float(p.body.A[0]) for x in p.body.A[1:]] for p in drawn.drawn(7, 400)]
    A2, A3 = np.array(shares).T
    apart, sum_ = A3 - A2, A2 + A3 - 1
    assert (apart > 0).all()
    assert (sum_ > -1e-3).all()
    # Middles of the sides cut off three corners. Four standard errors of a share of 400.
    for corner in (apart > 0.5, 1 - A3 > 0.25, sum_ > 0.5):
        assert abs(corner.mean() - 0.25) < 4 * np.sqrt(3 / 16 / 400)


def test_phases_are_as_many_as_asked_for() -> None:
    assert drawn.phases().shape == (drawn.ORBITS,)
    assert (drawn.phases(5) == drawn.phases(5)).all()
