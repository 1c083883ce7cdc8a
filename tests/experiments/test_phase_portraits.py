"""The experiment `phase_portraits`: curves of the Euler case, in closed form and no other way."""

from __future__ import annotations

import copy
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from rigidpend.mechanics.equations import eq1
from tests.experiments.trees import asked, computed, differences


@pytest.fixture(scope="module")
def content() -> Any:
    return asked("fig1")


@pytest.fixture(scope="module")
def data(content: Any) -> Any:
    return computed(content)


def curves(group: Any, field: str) -> list[Any]:
    return [group[field][..., a:b] for a, b in pairwise(group["offsets"])]


@pytest.mark.parametrize("name", ["orbits", "separatrices"])
def test_the_curves_in_the_plane_satisfy_the_unperturbed_equations(
    content: Any, data: Any, name: str
) -> None:
    p, group = content.problem.body.angles(), data[name]
    for x, y in zip(curves(group, "theta1"), curves(group, "J1"), strict=True):
        middle = ((x[1:] + x[:-1]) / 2, (y[1:] + y[:-1]) / 2, 0.0, 1.0)
        theta1_rate, J1_rate, _, _ = eq1(middle, p, np)
        dx, dy = np.diff(x), np.diff(y)
        along = dx * theta1_rate + dy * J1_rate
        across = dx * J1_rate - dy * theta1_rate
        # In the flow's sense, and along it but for the curvature within a step.
        assert (along >= 0).all()
        length = np.hypot(dx, dy) * np.hypot(theta1_rate, J1_rate)
        assert np.abs(across).max() < 2e-3 * length.max()


def test_visibility_may_change_on_the_outline_only(data: Any) -> None:
    stored = copy.deepcopy(data)
    stored["orbits"]["projected"][2, 7] = 5e-15
    for index, count in ((7, 0), (8, 1)):
        fresh = copy.deepcopy(stored)
        fresh["orbits"]["visible"][index] ^= True
        assert len(differences("phase_portraits", stored, fresh)) == count
