"""The experiment `phase_portraits`: curves of the Euler case, in closed form and no other way.

That free bodies move along such curves is tested with `mechanics.free_body`.
"""

import copy
from typing import Any

import pytest

from tests.experiments.trees import asked, computed, differences, unlike_stored


@pytest.fixture(scope="module")
def data() -> Any:
    return computed(asked("fig1"))


def test_all_is_as_it_is_stored(data: Any) -> None:
    assert unlike_stored("fig1", data, {}) == set()


def test_visibility_may_change_on_the_outline_only(data: Any) -> None:
    stored = copy.deepcopy(data)
    stored["orbits"]["projected"][2, 7] = 5e-15
    for index, count in ((7, 0), (8, 1)):
        fresh = copy.deepcopy(stored)
        fresh["orbits"]["visible"][index] ^= True
        assert len(differences("phase_portraits", stored, fresh)) == count
