"""Types of numbers: arrays of doubles, and generic ones such as floats, mpmath's, symbols."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Array: TypeAlias = "NDArray[np.float64]"
"""An array of doubles, by its name alone: what reads a config must not import NumPy."""
Scalar: TypeAlias = Any
"""A number or an array of numbers that knows ``+ - * /``: the caller chooses the kind."""
Numbers: TypeAlias = Any
"""A sequence or an array of such numbers, the component first."""


class Elementary(Protocol):
    """A namespace of elementary functions over one kind of numbers.

    `math`, `numpy`, an mpmath context and heyoka are such namespaces; a function that takes
    one says in its docstring which members it needs.
    """

    @property
    def pi(self) -> Any: ...
    @property
    def sqrt(self) -> Callable[[Any], Any]: ...
    @property
    def sin(self) -> Callable[[Any], Any]: ...
    @property
    def cos(self) -> Callable[[Any], Any]: ...
    @property
    def exp(self) -> Callable[[Any], Any]: ...
    @property
    def log(self) -> Callable[[Any], Any]: ...
    @property
    def expm1(self) -> Callable[[Any], Any]: ...
    @property
    def atan2(self) -> Callable[[Any, Any], Any]: ...
