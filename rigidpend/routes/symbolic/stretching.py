"""Stretching: growth of a deviation from passage to passage, by the map's derivatives.

A deviation is the difference of the places of two orbits of one energy on the section M3 = 0. Its
size is the Euclidean norm of the change of (M', gamma), six numbers that anybody who integrates the
equations of motion has too; M' grows with the root of the energies, and gamma does not. The
logarithm of its growth through some passages, divided by their number, is a finite-time exponent,
and tends to the Lyapunov exponent of the return map. Another norm changes the logarithm by a
bounded amount, however many passages there are.

The growth is computed for each passage of a chain, and for many orbits of Fig. 4's kind at once,
one for each theta2_0 and J1_0; the latter are compared with the variational equations.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.equations import aligned, variational
from rigidpend.numbers import Array
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.orbits.return_map.passage import EnergyLevel
from rigidpend.orbits.return_map.poincare import section_state, section_tangents
from rigidpend.orbits.return_map.reduced import Coefficients
from rigidpend.routes.symbolic.chain import ANGLES, Chain, carried, tangents
from rigidpend.routes.symbolic.levels import ChainLevel, Mask, OrbitFamily, onward

ROUNDINGS = 3
"""Number of roundings in a passage by the map: those of its sums, some 80 terms, mostly cancel."""
INTEGRATED = 0.1
"""Roundings of an integrated passage over those of one by the map, times the width of the layer.

Integration rounds numbers of the order of 1, and the map numbers as small as the layer: the thinner
the layer, the more roundings of the map equal one of integration."""
BENDING = 3.0
"""Relative change of a growth per radian by which chi of a crossing changes.

Derivatives of the passage behind the crossing contain harmonics of chi, which change as much as chi
relatively. So do those of the passage before it, which are also proportional to 1/U: the relative
change of U is Lambda < 1 times that of chi."""


def stretching(chain: Chain) -> Array:
    """ln of the growth of a deviation in each passage of a chain, (n,), measured by its chi.

    The deviation begins along chi. Behind the first passage it has the growing direction, but for
    a share of 1/growth^2. In this direction the change of d is that of chi times the order of mu,
    so that chi stands for the whole.
    """
    changes, logs = carried(tangents(chain), np.array([0.0, 1.0, 0.0]))
    return np.asarray(np.diff(logs + np.log(np.abs(changes[:, 1]))))


def most_stretched(slopes: Sequence[Array], frames: Sequence[Array]) -> Array:
    """ln of the growth of the deviation that grows most, through 1 to n passages, (n, ...).

    Divided by the number of passages it is the largest finite-time exponent. The slopes are the n
    derivatives (2, 2, ...) of d and chi behind each passage in d and chi before it. The frames are
    n + 1 matrices (2, 2, ...): :func:`frame` at the first crossing, and behind each passage.
    """
    # Singular values of a product, in frames where (d, chi) have the Euclidean norm of (M', gamma).
    whole, found = inverse(frames[0]), []
    for slope, behind in zip(slopes, frames[1:], strict=True):
        whole = product(slope, whole)
        found.append(np.log(largest_singular(product(behind, whole))))
    return np.array(found)


def frame(point: SectionPoint, h: Any, c: Coefficients) -> Array:
    """Matrices (2, 2, N) that take changes of (d, chi) to vectors with the length of (M', gamma).

    The energies h, (N,), are in physical units, as mu; the coefficients are doubles, for M' in
    units of one.
    """
    # The triangular factor of a QR decomposition of the two tangents, by Gram and Schmidt.
    moved = euclidean(section_tangents(*point, h, c, precision(53)), c)
    one, other = moved[:, 0], moved[:, 1]
    length = np.sqrt((one * one).sum(axis=0))
    along = (one * other).sum(axis=0) / length
    across = other - along * one / length
    rows = (length, along), (0 * length, np.sqrt((across * across).sum(axis=0)))
    return np.array(rows)


def euclidean(deviations: Array, c: Coefficients) -> Array:
    """Changes of (M', gamma) in principal axes, (6, ...), from those of the aligned components."""
    Qp, Qm, *others = deviations
    return np.stack((*c.momenta(Qp, Qm), *others))


def product(one: Array, other: Array) -> Array:
    """Products (2, 2, ...) of matrices (2, 2, ...)."""
    return np.asarray(np.einsum("ij...,jk...->ik...", one, other))


def inverse(matrices: Array) -> Array:
    """The inverses of matrices (2, 2, ...)."""
    found = np.linalg.inv(np.moveaxis(matrices, (0, 1), (-2, -1)))
    return np.asarray(np.moveaxis(found, (-2, -1), (0, 1)))


def largest_singular(matrix: Any) -> Any:
    """The larger singular value of matrices with two rows of two numbers or arrays."""
    # The closed form for two by two: the sum and difference of both singular values are the moduli
    # of the parts that keep and that reverse the orientation.
    (a, b), (c, d) = matrix
    return (np.hypot(a + d, b - c) + np.hypot(a - d, b + c)) / 2


class Stretched(NamedTuple):
    """N orbits of a body through n passages with the growth of a deviation, one in each column."""

    level: EnergyLevel
    """The map at the energy of each orbit."""
    coefficients: Coefficients
    begin: SectionPoint
    """The first crossings."""
    inside: Mask
    """(N,) True where the tables reach so far; elsewhere the other fields are void."""
    time: Array
    """(N,) t' from the first crossing to the last."""
    symbols: NDArray[np.uint8]
    """(n, N) 0 left, 1 right."""
    growth: Array
    """(n, N) ln of the growth of the deviation that grows most, through 1 to n passages."""
    allowed: Array
    """(N,) bound of the rounding error of the growth through all passages."""
    allowed_integrated: Array
    """(N,) the same of :func:`integrated`."""


def stretched(orbits: OrbitFamily, theta2_0: Array, J1_0: Array, n: int) -> Stretched:
    """Follow orbits of one body and h0 through n passages, by their theta2_0 (radians) and J1_0."""
    level, c = orbits.return_map.at(orbits.energy(theta2_0, J1_0)), orbits.return_map.coefficients
    begin = orbits.enter(level, theta2_0, J1_0)
    # Outside of the tables d may be so large that no point of the section has the energy.
    first = begin.point._replace(d=np.where(begin.inside, begin.point.d, 0.0))
    passed = list(onward(level, first, n, slopes=True))
    slopes = [each.slopes[:2] for each in passed]
    frames = [frame(point, level.h, c) for point in (first, *(each.point for each in passed))]
    inside = np.logical_and.reduce([begin.inside, *(each.inside for each in passed)])
    time = sum(each.time for each in passed)
    codes = np.array([each.symbol for each in passed], dtype=np.uint8)
    grown = most_stretched(slopes, frames)
    turned = (
        np.array([begin.time, *(each.time for each in passed)]) / level.rates(0 * time).rotation
    )
    # At all these energies, which differ by the weight alone, surfaces are split by about as much.
    at_h0 = ChainLevel(orbits.return_map, orbits.problem.h0)
    allowed = rounding(slopes, turned, at_h0.widest_d, at_h0.splitting, grown[-1])
    by_integration = INTEGRATED / at_h0.widest_d * allowed
    return Stretched(level, c, first, inside, time, codes, grown, allowed, by_integration)


def rounding(slopes: list[Array], turned: Array, width: float, split: float, grown: Array) -> Array:
    """Allowed error of ln of the growth through all passages, (N,): a theoretical bound.

    It is the sum of two. In each passage the place on the section errs by `ROUNDINGS`, of chi in
    radians and of d in widths of the layer, and by those of the angle through which it has turned,
    (n + 1, N) radians with that before the first crossing. From there to the next crossings the
    error grows as deviations do. At each crossing it changes the derivatives by `BENDING`, and
    thereby the growth through all passages by the growth before the crossing times that behind it,
    over the whole growth. The whole is exp(grown) in the Euclidean norm, hence `width` times that
    for a change of d by a width. Where deviations shrink again, it is far less than the product.

    The surfaces may be much steeper than the angle between them. A place that moves along them
    takes the deviations with it, so that here growths are those along the surfaces, with d from
    them in units of `split`, by which they are split. But the derivatives themselves, which have
    `ROUNDINGS` too, relatively, are those in d and chi: their growths are in widths and radians.
    """
    n, along = len(slopes), _along_surfaces(slopes, width, split)
    on_surfaces, plain = (_growths(slopes, frames) for frames in (along, along[:1] * (n + 1)))
    fresh = (1 + turned / ANGLES) * np.array([width / each[0, 0] for each in along])
    # The error of the place at crossing k: roundings at all crossings up to it, grown.
    place = np.array([(fresh[: k + 1] * on_surfaces[: k + 1, k]).sum(axis=0) for k in range(n + 1)])
    of_places = (BENDING * place * on_surfaces[0] * on_surfaces[:, n]).sum(axis=0)
    of_slopes = sum(plain[0, k] * plain[k, k + 1] * plain[k + 1, n] for k in range(n))
    whole = width * np.exp(grown)
    return np.asarray(ROUNDINGS * 2.0**-53 * (of_places + of_slopes) / whole)


def _growths(slopes: list[Array], frames: list[Array]) -> Array:
    """Largest growths from crossing j to crossing k, (n + 1, n + 1, N), in n + 1 frames."""
    n = len(slopes)
    scaled = [product(inverse(frames[k + 1]), product(slopes[k], frames[k])) for k in range(n)]
    found = np.ones((n + 1, n + 1, scaled[0].shape[-1]))
    for j in range(n):
        whole = scaled[j]
        found[j, j + 1] = largest_singular(whole)
        for k in range(j + 1, n):
            whole = product(scaled[k], whole)
            found[j, k + 1] = largest_singular(whole)
    return found


def _along_surfaces(slopes: list[Array], width: float, split: float) -> list[Array]:
    """Matrices (2, 2, N) that take changes along and across the surfaces to those of (d, chi).

    At the first and the last crossing, where deviations need not lie along a surface, they are
    changes of d in widths, and of chi.
    """
    zero = np.zeros(slopes[0].shape[-1])
    ends = np.array([[zero + width, zero], [zero, zero + 1]])
    found = [ends]
    for slope in slopes[:-1]:
        # Behind a passage all deviations lie nearly along the unstable surface.
        d, chi = product(slope, found[-1])
        steep = (d * chi).sum(axis=0) / (chi * chi).sum(axis=0)
        found.append(np.array([[zero + split, steep], ends[1]]))
    return [*found, ends]


def integrated(found: Stretched) -> Array:
    """ln of the largest growth through all passages, by the variational equations, (N,)."""
    # Two orthonormal deviations on the section, in the inverse frame, are carried to the end.
    c, a, at = found.coefficients, precision(53), (*found.begin, found.level.h)
    begun, off = section_state(*at, found.coefficients, a), section_tangents(*at, c, a)
    unit = np.linalg.inv(np.moveaxis(frame(found.begin, found.level.h, c), -1, 0))
    rates, ended = variational(c.aligned), []
    for beside in np.einsum("ijn,njk->kin", off, unit):
        end = states_at(rates, np.concatenate((begun, beside)), found.time[None])[:, 0]
        flow = np.array(aligned(end[:6], c.aligned))
        # At a fixed time the deviation leaves the section: back to M3 = 0 along the orbit.
        ended.append(euclidean(end[6:] - flow * (end[8] / flow[2]), c))
    # Scaled to the size of one, for squares of what has grown much overflow.
    most = np.abs(ended).max(axis=(0, 1))
    one, other = ended / most
    # The larger eigenvalue of their Gram matrix is the square of the larger singular value.
    sizes = (one * one).sum(axis=0), (other * other).sum(axis=0)
    both = np.hypot(sizes[0] - sizes[1], 2 * (one * other).sum(axis=0))
    return np.asarray(np.log(most) + np.log((sum(sizes) + both) / 2) / 2)
