"""The figure of a full shift: sets and images are drawn where they are."""

from __future__ import annotations

import numpy as np
import pytest

from rigidpend.experiments.full_shift.draw import draw
from tests.experiments.figures import check_on_page, styled
from tests.experiments.trees import reference


@pytest.mark.slow
def test_panels_have_the_sets_and_images_of_their_section_and_magnified_both_sides_of_each() -> (
    None
):
    result = reference("full_shift")
    drawn, sets = result["data"]["drawn"], result["data"]["sets"]
    figure = styled(draw, result, laid_out=True)
    check_on_page(figure)
    for k, axes in enumerate(figure.axes):
        rising = k % 2 == 0
        outlines = [
            patch.get_path().vertices for patch in axes.patches if len(patch.get_path()) > 9
        ]
        expected = [
            np.column_stack((drawn[f"{prefix}chi"][i], drawn[f"{prefix}d"][i]))
            for i, of in enumerate(sets["rising"])
            for prefix in ["" if of == rising else "image_"]
        ]
        assert len(outlines) == 4
        for found, outline in zip(outlines, expected, strict=True):
            np.testing.assert_array_equal(np.asarray(found)[: len(outline)], outline)
        if k >= 2:
            target = int(np.flatnonzero(sets["rising"] == rising)[-1])
            low, high = axes.get_ylim()
            here = np.abs(drawn["chi"][target]).argmin()
            assert low < drawn["d"][target][here] < high
            assert 1 < (high - low) / np.ptp(drawn["d"][target]) < 5
