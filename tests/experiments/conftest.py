"""Formulas of figures, each set once."""

from collections.abc import Iterator

import pytest
from matplotlib.mathtext import MathTextParser

from tests.remembered import remembered


@pytest.fixture(scope="package", autouse=True)
def once() -> Iterator[None]:
    """A formula is set once for all figures: matplotlib forgets it with each canvas."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(MathTextParser, "parse", remembered(MathTextParser.parse))
        yield
