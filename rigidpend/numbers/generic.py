"""Types of numbers: arrays of doubles, and generic ones such as floats, mpmath's, symbols."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Array: TypeAlias = "NDArray[np.float64]"
"""An array of doubles, by its name alone: what reads a config must not import NumPy."""
Scalar: TypeAlias = Any
"""A number or an array of numbers that knows ``+ - * /``: the caller chooses the kind."""
Numbers: TypeAlias = Any
"""A sequence or an array of such numbers, the component first."""
Elementary: TypeAlias = Any
"""A namespace of elementary functions over one kind of numbers.

`math`, `numpy`, an mpmath context and heyoka are such namespaces; a function that takes one is
written with pi, sqrt, sin, cos, exp, log, expm1 or atan2 of it."""
