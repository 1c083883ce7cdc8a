"""Levels of return maps: what is measured on them by looks at some phases."""

from __future__ import annotations

import numpy as np

from tests.routes.symbolic.fig4 import level


def test_the_splitting_is_the_largest_at_any_phase() -> None:
    here = level()
    b = np.linspace(0, 2 * np.pi, 5000)
    on = here.arriving(np.zeros(b.size), b)
    U, V, *_ = here.map_level.charts[True].forward.look_up(on.d, on.chi, here.map_level.a)
    every = np.abs(U * V)
    assert np.isclose(here.splitting, every.max(), rtol=1e-3)
    assert every.min() < 0.1 * every.max()
