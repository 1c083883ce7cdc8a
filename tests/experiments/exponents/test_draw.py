"""The figure of finite-time exponents: what is drawn is the file's."""

from __future__ import annotations

import numpy as np

from rigidpend.experiments.exponents.draw import draw
from tests.experiments.figures import styled
from tests.experiments.trees import reference


def test_exponents_and_their_check_are_drawn() -> None:
    result = reference("exponents")
    data = result["data"]
    plane, _, spread, check = styled(draw, result).axes
    np.testing.assert_allclose(np.asarray(plane.images[0].get_array()), data["exponent"])
    assert np.asarray(plane.lines[0].get_ydata())[0] == data["marked"]
    [median] = spread.lines
    np.testing.assert_allclose(np.asarray(median.get_ydata()), data["growth"]["exponent"][2])
    shown, allowed = (np.sort(np.asarray(line.get_ydata())) for line in check.lines)
    np.testing.assert_allclose(shown, np.sort(np.abs(data["checked"]["difference"])))
    np.testing.assert_allclose(allowed, np.sort(data["checked"]["allowed"]))


def test_a_plane_of_which_nothing_is_known_is_drawn() -> None:
    result = reference("exponents")
    for values in (result["data"]["exponent"], result["data"]["checked"]["growth"]):
        values[:] = np.nan
    figure = styled(draw, result)
    assert len(figure.axes) == 4
