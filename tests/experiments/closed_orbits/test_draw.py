"""The figure of closed orbits: every orbit has a mark of its own, averages are the file's."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigidpend.experiments.closed_orbits.draw import draw
from tests.experiments.figures import styled
from tests.experiments.trees import reference


def test_every_orbit_is_told_apart() -> None:
    """A place is one mark wide, and its length's tick is nearer than any other's marks are."""
    result = reference("closed_orbits")
    orbits = result["data"]["orbits"]
    axes = styled(draw, result).axes[0]
    marks = np.concatenate([line.get_xydata() for line in axes.lines])
    marks = marks[marks[:, 0].argsort()]
    assert np.diff(marks[:, 0]).min() > 1 - 1e-9
    begins = np.append(0, np.flatnonzero(np.diff(marks[:, 0]) > 1.5) + 1)
    length = (orbits["word"] < 2).sum(axis=1)
    for n, group in enumerate(np.split(marks, begins[1:]), start=1):
        np.testing.assert_allclose(group[:, 0].mean(), axes.get_xticks()[n - 1])
        np.testing.assert_allclose(np.sort(group[:, 1]), np.sort(orbits["exponent"][length == n]))
    assert n == 8
    named: list[Any] = list(axes.texts)
    first = {text.get_text(): text.xy for text in named}
    assert first.keys() == {"0", "1", "01", "10"}
    np.testing.assert_allclose(first["10"][1], orbits["exponent"][3])


def test_averages_are_drawn_by_their_distance_from_the_last() -> None:
    result = reference("closed_orbits")
    averages = result["data"]["averages"]
    error, mean = styled(draw, result).axes[1].lines
    np.testing.assert_allclose(
        np.asarray(mean.get_ydata()), np.abs(averages["mean"][:-1] - averages["mean"][-1])
    )
    np.testing.assert_allclose(np.asarray(error.get_ydata()), averages["long_orbit_error"])
