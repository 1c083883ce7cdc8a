"""Arrays of sums of two or three doubles, 106 or 159 bits, used like NumPy's own arrays.

The tables of a return map are made with pairs where doubles do not suffice, and arcs that need more
digits than pairs have begin in sums of three. The arithmetic is that
of the kernels, so that the tables are the same on every machine.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from rigidpend.orbits.integrate.kernel.lane_numbers import exactly
from rigidpend.orbits.integrate.kernel.machine_code import LANES
from rigidpend.orbits.integrate.kernel.sum_loops import (
    OPERATIONS,
    WIDE_LANES,
    convolution,
    elementwise,
    products,
)

DOUBLE = 53
"""Bits of each part."""


def _operated(name: str, *, turned: bool = False) -> Callable[[Any, Any], SumArray]:
    """A method for an operator, element by element; `turned` exchanges the operands."""
    return lambda a, b: _joined(name, b, a) if turned else _joined(name, a, b)


def _compared(relation: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """A method that compares arrays, element by element."""
    # The sign of the difference is that of its larger part.
    return lambda a, b: relation((a - b).parts[0], 0)


class SumArray:
    """An array of numbers, each the sum of two doubles or more, the largest first.

    Each double is at most half an ulp of the one before. Numbers of fewer parts in an operation
    are taken for numbers of as many as the other's.
    """

    __slots__ = ("parts",)
    parts: Any
    """The largest doubles of all numbers, then the smaller ones, (parts, ...)."""

    def __init__(self, parts: Any) -> None:
        self.parts = parts

    @classmethod
    def of(cls, x: Any, count: int = 2) -> SumArray:
        """Numbers of `count` parts with the values of doubles or of sums, cut off if need be."""
        known = x.parts if isinstance(x, SumArray) else np.asarray(x, dtype=float)[None]
        if isinstance(x, SumArray) and len(known) >= count:
            return x if len(known) == count else cls(known[:count])
        parts = np.zeros((count, *known.shape[1:]))
        parts[: len(known)] = known
        return cls(parts)

    # NumPy's functions called on pairs come to these two; those that are not in the tables below
    # end as a TypeError, and never as arithmetic of objects.
    def __array_ufunc__(self, ufunc: Any, method: str, *given: Any, **_: Any) -> Any:
        found = UFUNCS.get(ufunc)
        return NotImplemented if method != "__call__" or found is None else found(*given)

    def __array_function__(self, function: Any, _: Any, given: Any, named: Any) -> Any:
        found = FUNCTIONS.get(function)
        return NotImplemented if found is None else found(*given, **named)

    def __array__(self, *_: Any, **__: Any) -> Any:
        # np.asarray would drop the smaller parts silently.
        raise TypeError("sums of doubles are no array of NumPy's: ask for their doubles")

    @property
    def shape(self) -> Any:
        return self.parts.shape[1:]

    @property
    def ndim(self) -> int:
        return int(self.parts.ndim) - 1

    @property
    def size(self) -> int:
        return int(self.parts[0].size)

    @property
    def T(self) -> SumArray:
        return self.transpose(*range(self.ndim - 1, -1, -1))

    def exactly(self) -> Any:
        """The values as Fractions."""
        return exactly(self.parts)

    def __len__(self) -> int:
        return len(self.parts[0])

    def __float__(self) -> float:
        return float(self.parts[0])

    def __bool__(self) -> bool:
        return bool(self.parts[0])

    def __getitem__(self, key: Any) -> SumArray:
        return SumArray(self.parts[_in_both(key)])

    def __setitem__(self, key: Any, value: Any) -> None:
        given, there = SumArray.of(value, len(self.parts)), _in_both(key)
        self.parts[there] = _of_dimensions(given, self.parts[there].ndim - 1)

    __add__ = __radd__ = _operated("add")
    __mul__ = __rmul__ = _operated("multiply")
    __sub__, __rsub__ = _operated("subtract"), _operated("subtract", turned=True)
    __truediv__, __rtruediv__ = _operated("divide"), _operated("divide", turned=True)
    __eq__, __ne__ = _compared(operator.eq), _compared(operator.ne)
    __lt__, __le__ = _compared(operator.lt), _compared(operator.le)
    __gt__, __ge__ = _compared(operator.gt), _compared(operator.ge)

    def __matmul__(self, other: Any) -> SumArray:
        return matmul(self, other)

    def __rmatmul__(self, other: Any) -> SumArray:
        return matmul(other, self)

    def __neg__(self) -> SumArray:
        return SumArray(-self.parts)

    def __pow__(self, exponent: int) -> SumArray:
        found = self
        for _ in range(exponent - 1):
            found = found * self
        return found

    def __abs__(self) -> SumArray:
        return SumArray(np.where(self.parts[:1] < 0, -self.parts, self.parts))

    def __hash__(self) -> int:
        return hash(self.exactly())

    def astype(self, kind: Any) -> Any:
        """The larger parts, which are the doubles nearest to the numbers."""
        return self.parts[0].astype(kind)

    def reshape(self, *shape: Any) -> SumArray:
        shape = shape[0] if isinstance(shape[0], tuple) else shape
        return SumArray(self.parts.reshape(len(self.parts), *shape))

    def transpose(self, *axes: int) -> SumArray:
        return SumArray(self.parts.transpose(0, *(1 + k for k in axes)))

    def sum(self, axis: int) -> SumArray:
        """The sum over an axis, added up pairwise, for few calls and small errors."""
        rows = SumArray(np.moveaxis(self.parts, axis % self.ndim + 1, 1))
        while len(rows) > 1:
            half = len(rows) // 2
            total = rows[:half] + rows[half : 2 * half]
            rows = _concatenate([total, rows[2 * half :]]) if len(rows) % 2 else total
        return rows[0]

    def max(self) -> float:
        """The largest number, rounded to a double."""
        return float(self.parts[0].max())


def _in_both(key: Any) -> Any:
    """An index for the array of all parts."""
    return (slice(None), *(key if isinstance(key, tuple) else (key,)))


def _joined(name: str, a: Any, b: Any = 0.0) -> SumArray:
    """An operation on one or two arrays, element by element; one of `OPERATIONS`."""
    if type(a) is type(b) and a.parts.shape == b.parts.shape and a.ndim:
        # So are most, and short: to look for parts that lack takes longer than the operation.
        out = np.empty(a.parts.shape)
        elementwise(name, DOUBLE * len(out))(*a.parts, *b.parts, *out)
        return SumArray(out)
    count = _count(a, b)
    left, right = _parts(a, count), _parts(b, count)
    out = np.empty((count, *np.broadcast(left[0], right[0]).shape))
    # `out[k, ...]` is an array even where the shape is (); `out[k]` would be a copied number.
    elementwise(name, DOUBLE * count)(*left, *right, *(out[k, ...] for k in range(count)))
    return SumArray(out)


def _count(*arrays: Any) -> int:
    """The largest number of parts of the numbers of some arrays."""
    return max(len(x.parts) for x in arrays if type(x) is SumArray)


def _parts(x: Any, count: int) -> list[Any]:
    """The parts of numbers, or of doubles, whose smaller parts are zero."""
    if type(x) is SumArray:
        known = list(x.parts)
    else:
        known = [x if isinstance(x, (int, float)) else np.asarray(x, dtype=float)]
    return known + [0.0] * (count - len(known))


def _widened(parts: Any, width: int) -> Any:
    """Parts with ones behind the last column."""
    found, known = np.empty((*parts.shape[:-1], width)), parts.shape[-1]
    found[..., :known], found[..., known:] = parts, 1.0
    return found


def _broadcast(x: SumArray, shape: Any) -> SumArray:
    return SumArray(np.broadcast_to(_of_dimensions(x, len(shape)), (len(x.parts), *shape)))


def _of_dimensions(x: SumArray, n: int) -> Any:
    """The parts of an array as one of n dimensions, by further first ones of length 1."""
    # NumPy's broadcasting would put the new dimensions before the one that counts the parts.
    return x.parts.reshape(len(x.parts), *(1,) * (n - x.ndim), *x.shape)


def matmul(a: Any, b: Any) -> SumArray:
    """The product of matrices, or of stacks of matrices, with NumPy's rules."""
    count = _count(a, b)
    a, b = SumArray.of(a, count), SumArray.of(b, count)
    # Vectors as matrices of one row, or of one column.
    if a.ndim == 1:
        return matmul(a[None], b)[..., 0] if b.ndim == 1 else matmul(a[None], b)[..., 0, :]
    if b.ndim == 1:
        return matmul(a, b[:, None])[..., 0]
    outer, width = np.broadcast_shapes(a.shape[:-2], b.shape[:-2]), b.shape[-1]
    rows, terms = a.shape[-2:]
    # With one b for all, the matrices of a stack are rows of a single one.
    if b.ndim == 2 and a.ndim > 2:
        return matmul(a.reshape(-1, terms), b).reshape(*outer, rows, width)
    x, y = (z if z.ndim == 2 else _broadcast(z, (*outer, *z.shape[-2:])) for z in (a, b))
    right = y.parts if width >= LANES else _widened(y.parts, LANES)
    left, right = np.ascontiguousarray(x.parts), np.ascontiguousarray(right)
    wide = right.shape[-1]
    out = np.empty((count, *outer, rows, wide))
    sets, multiply = math.prod(outer), products(DOUBLE * count)
    multiply(out, left, right, rows, terms, wide, sets, x.ndim > 2, y.ndim > 2)
    return SumArray(out[..., :width])


def convolved(a: Sequence[Any], b: Sequence[Any]) -> Any:
    """The sum of products of polynomials, a[0] b[0] + a[1] b[1] + ..., all of the same degree.

    Polynomials are arrays of coefficients, (p, ...) and (q, ...), where further axes are the same
    for all; the sum is (p + q - 1, ...). All are arrays of pairs, or all of doubles.
    """
    parts = _count(*a) if isinstance(a[0], SumArray) else 1
    shape, rows = a[0].shape[1:], len(a[0]) + len(b[0]) - 1
    width = math.prod(shape)
    wide = max(width, WIDE_LANES)

    def matrices(factors: Sequence[Any]) -> list[Any]:
        """The parts of polynomials as the compiled loop reads them, (parts, p, `wide`) each."""
        given = [x.parts if parts > 1 else x for x in factors]
        flat = [np.ascontiguousarray(x).reshape(parts, -1, width) for x in given]
        return flat if width == wide else [_widened(x, wide) for x in flat]

    # Named, so that the arrays live until the loop has read them by their addresses.
    factors = matrices(a), matrices(b)
    out = np.empty((parts, rows, wide))
    tables = [
        *(np.array([x.ctypes.data for x in each]) for each in factors),
        np.array([len(x) for x in a]),
        np.empty((3, rows, parts, WIDE_LANES)),
    ]
    convolution(DOUBLE * parts)(out, *tables, len(a), rows, wide)
    found = out[..., :width].reshape(parts, rows, *shape)
    return SumArray(found) if parts > 1 else found[0]


# sqrt, exp and atan2 begin with NumPy's function of the largest part, whose error is some 2^-53.
# Each correction leaves the square of the error before it, or less; one for each further part.
def sqrt(x: SumArray) -> SumArray:
    count = len(x.parts)
    near = SumArray.of(np.sqrt(x.parts[0]), count)
    for _ in range(1, count):
        near = near + (x - near * near) / (2 * near.parts[0])
    return near


def exp(x: SumArray) -> SumArray:
    count = len(x.parts)
    near = SumArray.of(np.exp(x.parts[0]), count)
    for _ in range(1, count):
        # exp(x) = near exp(left), where left = x - ln(near) is some 2^-53 (1 + |x|) at first.
        left = x - _joined("log", near)
        near = near + near * (left + left * left / 2)
    return near


def atan2(y: Any, x: Any) -> SumArray:
    count = _count(y, x)
    y, x = SumArray.of(y, count), SumArray.of(x, count)
    near = SumArray.of(np.arctan2(y.parts[0], x.parts[0]), count)
    for _ in range(1, count):
        c, s = _joined("cos", near), _joined("sin", near)
        # The tangent of the angle that is missing, which is so small that it is the angle itself.
        near = near + (y * c - x * s) / (x * c + y * s)
    return near


cos, sin = functools.partial(_joined, "cos"), functools.partial(_joined, "sin")


def log(x: Any) -> SumArray:
    """The natural logarithm of |x|; minus infinity of zero."""
    found = _joined("log", x)
    zero = SumArray.of(x).parts[0] == 0
    found.parts[0, zero], found.parts[1:, zero] = -np.inf, 0.0
    return found


def _gathered(function: Callable[..., Any]) -> Callable[..., SumArray]:
    """A function for pairs from one of NumPy's that puts arrays together along an axis."""

    def found(arrays: Any, axis: int = 0) -> SumArray:
        count = _count(*arrays)
        parts = [SumArray.of(x, count).parts for x in arrays]
        # The axis of the parts comes first, which shifts only axes that count from the front.
        return SumArray(function(parts, axis=axis + 1 if axis >= 0 else axis))

    return found


_concatenate = _gathered(np.concatenate)


def _where(condition: Any, x: Any, y: Any) -> SumArray:
    count = _count(x, y)
    arrays = SumArray.of(x, count), SumArray.of(y, count)
    n = max(np.ndim(condition), *(z.ndim for z in arrays))
    return SumArray(np.where(condition, *(_of_dimensions(z, n) for z in arrays)))


def _all_of(*arrays: Any) -> list[SumArray]:
    made = [SumArray.of(x, _count(*arrays)) for x in arrays]
    shape = np.broadcast_shapes(*(x.shape for x in made))
    return [_broadcast(x, shape) for x in made]


UFUNCS: dict[Any, Callable[..., Any]] = {
    **{getattr(np, name): functools.partial(_joined, name) for name in OPERATIONS},
    np.log: log,
    np.matmul: matmul,
    np.negative: SumArray.__neg__,
    np.absolute: SumArray.__abs__,
    np.less: _compared(operator.lt),
    np.less_equal: _compared(operator.le),
    np.greater: _compared(operator.gt),
    np.greater_equal: _compared(operator.ge),
    np.equal: _compared(operator.eq),
    np.not_equal: _compared(operator.ne),
}
FUNCTIONS: dict[Any, Callable[..., Any]] = {
    np.atleast_1d: lambda x: x if x.ndim else x.reshape(1),
    np.shape: lambda x: x.shape,
    np.where: _where,
    np.stack: _gathered(np.stack),
    np.concatenate: _concatenate,
    np.append: lambda x, y: _concatenate([x, y.reshape(1)]),
    np.broadcast_arrays: _all_of,
    np.zeros_like: lambda x, shape=None: SumArray(
        np.zeros((len(x.parts), *(x.shape if shape is None else shape)))
    ),
    np.ones_like: lambda x: SumArray.of(np.ones(x.shape), len(x.parts)),
    np.repeat: lambda x, n, axis=0: SumArray(np.repeat(x.parts, n, axis=axis + 1)),
    np.tile: lambda x, n: SumArray(np.tile(x.parts, (1, n))),
}
