"""The figure of doubly asymptotic orbits: what is drawn is the file's."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigidpend.experiments.asymptotic_orbits.draw import draw
from tests.experiments.figures import styled
from tests.experiments.trees import reference


def test_orbits_are_drawn_where_the_file_has_them() -> None:
    result = reference("asymptotic_orbits")
    data = result["data"]
    plane, heights, *hodographs = styled(draw, result).axes
    lines: dict[Any, Any] = {line.get_label(): line for line in plane.collections[1:]}
    for name, orbits in data["orbits"].items():
        segments = np.array(lines[f"orbits {name}"].get_segments())
        np.testing.assert_allclose(segments[:, 0, 0], orbits["theta2_0"])
        np.testing.assert_allclose(segments[:, :, 1].mean(axis=1), int(name) + 1)
    codes = np.asarray(plane.collections[0].get_array())
    np.testing.assert_array_equal(
        codes.reshape(data["plane"]["codes"].shape), data["plane"]["codes"]
    )
    for k, curve in enumerate(data["drawn"].values()):
        drawn = np.asarray(heights.lines[k].get_ydata())
        np.testing.assert_allclose(drawn[np.isfinite(drawn)], curve["J1_over_J2"])
        np.testing.assert_allclose(
            np.asarray(hodographs[k].lines[0].get_ydata()), curve["omega"][:, 0]
        )


def test_without_sampled_orbits_the_plane_is_alone() -> None:
    result = reference("asymptotic_orbits")
    result["data"]["drawn"] = {}
    [plane] = styled(draw, result).axes
    assert plane.get_title("left").startswith("a)")
