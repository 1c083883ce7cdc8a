"""The experiment `phase_portraits`: curves of the Euler case, in closed form and no other way.

That free bodies move along such curves is tested with `mechanics.free_body`.
"""

import copy
import itertools
from typing import Any

import numpy as np
import pytest

from rigidpend import experiments
from tests.experiments.pages import assert_legible, styled
from tests.experiments.trees import asked, computed, differences, reference


def test_no_curve_is_cut_where_rounding_puts_it_on_a_separatrix() -> None:
    """A cut one would be drawn as a line across the window of 4 pi."""
    near = "problem.heights=[0.999999999999999, 0.9999999999999999]"
    curves = computed(asked("fig1", near))["orbits"]
    each = np.split(curves["theta1"], curves["offsets"][1:-1])
    assert len(each) == 8
    assert max(map(np.ptp, each)) < 3.8213, "no cell is wider than 2 alpha0"


def test_levels_of_a_nearly_symmetric_body_keep_their_digits() -> None:
    """kappa/2 is 2.5e9, beside which they would be rounded to 1e-7."""
    orbits = computed(asked("fig1", "problem.A=[1, 1 - 2e-10, 1 - 1e-10]"))["orbits"]
    # alpha0 is pi/2 up to 1e-10; (1 - height^2)/4 with the sign of the axis.
    expected = (1 - orbits["height"] ** 2) / 4 * np.where(orbits["around"] == 2, 1, -1)
    np.testing.assert_allclose(orbits["level"], expected, atol=1e-10)


def test_levels_of_a_thin_body_keep_their_digits() -> None:
    """Around M1 they are about 1e-17, where cos(theta1 - beta0) and cos(alpha0) are near -1."""
    orbits = computed(asked("fig1", "problem.A=[1, 1e-8, 1 - 1e-8]"))["orbits"]
    cos2 = (1e-8 / (1 - 1e-8)) ** 2
    expected = (1 - orbits["height"] ** 2) / 2 * np.where(orbits["around"] == 2, 1 - cos2, -cos2)
    np.testing.assert_allclose(orbits["level"], expected, rtol=1e-14)


def test_the_table_tells_levels_of_a_thin_body_apart() -> None:
    """All energies are 5e-9 J2^2 in ten decimals, and differ by 1e-17 of it around M1."""
    content = asked("fig1", "problem.A=[1, 1e-8, 1 - 1e-8]")
    told: Any = {"attributes": {"experiment": content.experiment}, "data": computed(content)}
    table, separatrices = experiments.tables(told)
    assert len({(row[0], row[-1]) for row in table.rows}) == len(table.rows)
    kappa = 1e-8 / ((1 - 1e-8) * (1 - 1e-8))
    for row in (table.rows[0][:-1], separatrices.rows[0]):
        assert float(row[-1]) == pytest.approx(kappa / 2, rel=1e-7, abs=0)


def test_visibility_may_change_on_the_outline_only() -> None:
    stored = reference("fig1")["data"]
    assert not differences("phase_portraits", stored, computed(asked("fig1")))
    stored["orbits"]["projected"][2, 7] = 5e-15
    for index, count in ((7, 0), (8, 1)):
        fresh = copy.deepcopy(stored)
        fresh["orbits"]["visible"][index] ^= True
        assert len(differences("phase_portraits", stored, fresh)) == count


VIEWS = [
    *(("pi/3", "pi/2"), ("2.5", "-1.2"), ("-pi/2", "0")),
    *itertools.product(("0", "0.62", "1.24", "2.48"), ("-1", "0", "1")),
]


@pytest.mark.parametrize(("azimuth", "elevation"), VIEWS)
def test_the_sphere_can_be_read_from_wherever_it_is_seen(azimuth: str, elevation: str) -> None:
    """Names of axes and numbers of separatrices, on the page and not upon the legend below."""
    view = f"problem.view={{azimuth: {azimuth}, elevation: {elevation}}}"
    told, data = {"experiment": "phase_portraits"}, computed(asked("fig1", view))
    assert_legible(styled({"attributes": told, "data": data}))


def test_the_sphere_is_round_where_orbits_have_few_points() -> None:
    """Of nine points it would be drawn as an octagon."""
    sphere = computed(asked("fig1", "problem.points=9"))["sphere"]
    middles = (sphere["outline"][:, 1:] + sphere["outline"][:, :-1]) / 2
    assert (middles**2).sum(axis=0).min() > 0.999
