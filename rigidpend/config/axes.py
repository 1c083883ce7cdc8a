"""Axes of planes in configs: cells side by side between two ends."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Self, TypeAlias

from pydantic import Field, model_validator

from rigidpend.config.schema import Number, Part, Whole, physics
from rigidpend.numbers.checked import ParameterError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MOST = 100_000
"""Cells along an axis at most."""
ENDS = Field(ge=2, le=MOST)
Range: TypeAlias = tuple[Number, Number]


class Axis(Part):
    """The cells of an axis, side by side between two ends."""

    ends: Range
    """The ends, ascending; radians, the decadic logarithm, or dimensionless."""
    count: Annotated[Whole, ENDS]
    """Number of cells; each stands for its middle."""

    def within(self, ends: Range) -> Axis:
        """As many cells between other ends."""
        return Axis.model_construct(ends=ends, count=self.count)

    @property
    def values(self) -> NDArray[np.float64]:
        """The middles of the cells, doubles."""
        import numpy as np

        low, high = map(float, self.ends)
        return low + (high - low) * (np.arange(self.count) + 0.5) / self.count

    @model_validator(mode="after")
    def _distinct(self) -> Self:
        distinct(self, "ends")
        return self


def distinct(axis: Axis, field: str) -> None:
    """Refuse an axis whose cells doubles do not tell apart."""
    low, high = map(float, axis.ends)
    finest = 16 * math.ulp(max(abs(low), abs(high)))
    with physics():
        if not low < high:
            raise ParameterError(field, f"the ends must ascend, got {low} and {high}")
        if high - low < finest * axis.count:
            message = f"{axis.count} cells between {low!r} and {high!r} are too fine for doubles"
            raise ParameterError(field, message)
