"""Numbers taken exactly as they are written.

Modules
-------
exact    exact numbers: rationals, pi, texts such as 3*pi/40, and functions of them
texts    numbers, codes and values as texts
checked  checks of arguments, which are taken exactly or refused in a sentence

Types for functions of any kind of number: arrays of doubles, and generic numbers such as floats,
mpmath's, or symbols.
"""

from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Array: TypeAlias = "NDArray[np.float64]"
"""An array of doubles. The alias is a text, since code that reads configs must not import NumPy."""
Scalar: TypeAlias = Any
"""A number, or an array of numbers, with ``+ - * /``; the caller chooses the kind."""
Numbers: TypeAlias = Any
"""A sequence or an array of such numbers, whose first axis counts components."""
Elementary: TypeAlias = Any
"""A namespace of elementary functions over one kind of number.

`math`, `numpy`, an mpmath context and heyoka are such namespaces. A function that takes one uses
its pi, sqrt, sin, cos, exp, log, expm1 or atan2."""
