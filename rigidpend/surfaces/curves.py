"""Curves of orbits on the asymptotic surfaces (the stable and unstable manifolds) of Fig. 3."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.body import Body, direction
from rigidpend.mechanics.coordinates import Aligned, canonical_from_aligned
from rigidpend.mechanics.floquet import periodic_orbit
from rigidpend.mechanics.free_body import exponent
from rigidpend.numbers import Array, Scalar
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import Exact, context, exact, function
from rigidpend.orbits.integrate.states import states_at
from rigidpend.routes.problem import RouteProblem, phase_rate
from rigidpend.routes.start import Scales, start, states_double

PER_TURN = 96
"""Number of samples in a turn of theta2, or in a time 2 pi/u if that is shorter."""
LEAST_WEIGHT = 1e-12
"""Least mu/h0. Below it doubles resolve little of the swing that the window's unit is."""
SAMPLE, MOTION, ENERGIES = 6e-7, 2e-3, 200
"""Seconds of a core for a sample and for a pendulum motion, and the largest number of motions.

Measured with bodies of nu from 7 to 1,036, of 18 to 10,000 orbits, on a busy machine."""
ON_SURFACE = 1e-3
"""Distance from the surface at a curve's first point, relative to that at its orbit's start."""
AT_ONCE, MOST_SAMPLES = 2_000_000, 5_000_000
"""Largest number of samples that memory holds at a time, of some 220 bytes each, and of an orbit.

With so many an orbit turns some 50,000 times: from J1_0 = 1e-8 J2_0 on at nu = 28,000."""
CHORD = 4e-4
"""Allowed distance of a chord from its curve, in units of the window's height and half width.

In a panel 2.35 inches high that is a quarter of the width of the line that draws it."""


class SurfaceCurves(NamedTuple):
    """Curves of different lengths, stored one after the other."""

    theta1: Array
    """Angle theta1, radians, near alpha0 + beta0."""
    J1_over_J2: Array
    """Ratio J1/J2."""
    sample: NDArray[np.int32]
    """Time of each point, as an index of :func:`times`."""
    offsets: NDArray[np.int64]
    """Bounds of the curves: curve k is ``offsets[k]:offsets[k + 1]``."""
    theta2_0: Array
    """Phase at the start of each orbit, radians in [0, 2 pi)."""


def surface_problem(
    A: Sequence[Exact], beta0: Exact | None, mu: Exact, M_0: Exact, J1_0: Exact
) -> RouteProblem:
    """Start of orbits of a body with |M| = M_0, that is h0 = M_0^2/(2 A3), M_0 and mu physical.

    If beta0 is None it is gamma0, for which r is (sqrt(A1 - A3), sqrt(A3 - A2), 0) by (phi). J1_0
    is dimensionless, 0 < J1_0 < `ON_SURFACE` J2_0/2. ParameterError names the condition that is
    broken.
    """
    if not M_0.at(113) > 0:
        raise ParameterError("M_0", f"M_0 > 0 is broken: M_0 = {M_0}")
    # J2_0 = 2/sqrt(A3 kappa) of Fig. 3 is |M| = 2 in physical units. All is exact, so that no
    # rounding decides whether a condition holds.
    h0 = M_0 * M_0 / (2 * A[2])
    if not (h0 - mu).at(113) > 0:
        shown = f"M_0 = {M_0}, A3 = {A[2]}, mu = {mu}"
        raise ParameterError("M_0", f"h0 = M_0^2/(2 A3) > mu is broken: {shown}")
    if not mu.at(113) >= LEAST_WEIGHT * h0.at(113):
        broken = f"mu >= {LEAST_WEIGHT} h0 is broken: mu = {mu}, h0 = {float(h0):.6g}"
        raise ParameterError("mu", f"{broken}; without a weight both surfaces are separatrix 2")
    found = RouteProblem(Body(A, _direction(A, beta0), mu), h0, J1_0, 1)
    # Curves begin where J1 is J1_0/`ON_SURFACE`. Beyond the section orbits go away from S1- again.
    if not 2 * float(J1_0) < ON_SURFACE * float(found.J2_0(53)):
        broken = f"J1_0 < J2_0/{2 / ON_SURFACE:.0f} is broken: J1_0 = {J1_0}"
        raise ParameterError(
            "J1_0", f"{broken}; orbits that start so high do not come close to S1-"
        )
    samples = _steps(found)[1] + 1
    if samples > MOST_SAMPLES:
        said = f"the body of A = ({', '.join(map(str, A))}) is too nearly symmetric"
        turns = f"an orbit takes {samples:.2g} samples, more than {MOST_SAMPLES:.2g}"
        raise ParameterError("bodies", f"{said}, nu = {found.body.nu:.3g}: {turns}")
    return found


def _direction(A: Sequence[Exact], beta0: Exact | None) -> tuple[Any, Any, Any]:
    """Direction r of the centre of gravity by (phi), of any length."""
    if beta0 is not None:
        return direction(beta0)
    # Moments that make no body are refused later, by Body, with a better message.
    first, second = (x if x.at(113) > 0 else exact(1) for x in (A[0] - A[2], A[2] - A[1]))
    return function("sqrt", first), function("sqrt", second), 0


def S1_minus(
    problem: RouteProblem, theta2_0: Array, half_width: float, engine: str, tolerance: Any = None
) -> SurfaceCurves:
    """Orbits on S1-, which leave the lower periodic solution beside separatrix 2, forward in time.

    They start near the surface, at theta1 = alpha0 + beta0 and the problem's J1_0. The distance
    from the surface shrinks as 1/J1 (eq. dtheta). So the curves begin at J1 = J1_0/`ON_SURFACE`, to
    lie on it, and end with the first point farther than `half_width`, radians. Raises
    ArithmeticError where an orbit's pendulum motion has no S1-.
    """
    _check_hyperbolic(problem, theta2_0)
    p, fine, t = problem.body.angles(), problem.body.angles(113), times(problem)
    begin = start(problem, 53, Scales())
    # J1 grows as exp(u t) beside the lower periodic orbit.
    first = int(np.argmax(t > -math.log(ON_SURFACE) / exponent(float(problem.J2_0(53)), p, math)))
    curves: list[tuple[Array, Array, NDArray[np.intp]]] = []
    at_once = max(1, AT_ONCE // t.size)
    for k in range(0, theta2_0.size, at_once):
        # These starts have exactly theta1 of the separatrix and are not on the surface.
        orbits = states_at(
            begin.coefficients,
            states_double(begin, theta2_0[k : k + at_once], 0.0),
            t,
            engine=engine,
            tolerance=tolerance,
        )
        theta1, ratio = projected(orbits[:, first:], fine.alpha0, p.beta0)
        across = (theta1 - p.alpha0 - p.beta0) / half_width
        for x, y, angle in zip(across.T, ratio.T, theta1.T, strict=True):
            kept = points(x, y)
            curves.append((angle[kept], y[kept], first + kept))
    flat, ratios, samples = (np.concatenate(x) for x in zip(*curves, strict=True))
    offsets = np.cumsum([0, *(rows.size for *_, rows in curves)])
    return SurfaceCurves(
        flat, ratios, samples.astype(np.int32), offsets, np.mod(theta2_0, math.tau)
    )


def _check_hyperbolic(problem: RouteProblem, theta2_0: Array) -> None:
    """Raise ArithmeticError unless the pendulum motions of the orbits' energies have an S1-."""
    p, h0 = problem.body.angles(), float(problem.h0)
    # The energy of an orbit is h0 + mu sin(theta2_0), here to a hundredth of mu: a motion takes
    # some milliseconds, and there may be thousands of phases.
    for height in np.unique(np.round(np.sin(theta2_0), 2)):
        try:
            periodic_orbit(p, h0 + p.mu * height)
        except (ArithmeticError, ValueError) as error:
            whose = f"the body of A = ({', '.join(map(str, problem.body.A))})"
            said = f"no S1- of {whose} was found at the energy {h0 + p.mu * height:.6g}: {error}"
            raise ArithmeticError(f"{said}; take less weight") from None


def S2_plus(lower: SurfaceCurves, alpha0: float, beta0: float) -> SurfaceCurves:
    """Orbits on S2+, which end at the upper periodic solution, backward in time: S1- mirrored.

    As r3 = 0 and J3 = 0, a change of sign of M3, gamma3 and t takes an orbit to another one. It
    keeps theta1, exchanges J1 and J2 - J1 and takes theta2 to pi - theta1 - theta2.
    """
    theta2_0 = np.mod(math.pi - alpha0 - beta0 - lower.theta2_0, math.tau)
    return lower._replace(J1_over_J2=1 - lower.J1_over_J2, theta2_0=theta2_0)


def times(problem: RouteProblem) -> Array:
    """Equally spaced times t' from 0, in which J1 goes from J1_0 to J2_0 - J1_0 on separatrix 2."""
    whole, steps = _steps(problem)
    return np.linspace(0, whole, steps + 1)


def expected_seconds(problem: RouteProblem, orbits: int) -> float:
    """Estimate of the seconds that so many orbits on S1- take on one core."""
    return orbits * _steps(problem)[1] * SAMPLE + min(orbits, ENERGIES) * MOTION


def _steps(problem: RouteProblem) -> tuple[float, int]:
    """The last of the times t', and the number of steps up to it."""
    J2 = float(problem.J2_0(53))
    # J1 = J2/2 is reached at u t = v of (sol_2), J2_0 - J1_0 after as much again.
    rate = exponent(J2, problem.body.angles(), math)
    # A J1_0 below all doubles has a logarithm.
    m = context(53)
    whole = 2 * float(m.log(J2 / problem.J1_0.at(53) - 1)) / rate
    return whole, math.ceil(whole * phase_rate(problem) * PER_TURN / math.tau)


def projected(orbits: Array, alpha0: Scalar, beta0: float) -> tuple[Array, Array]:
    """Map aligned states (6, n, ...) to theta1, which begins near alpha0 + beta0, and J1/J2."""
    c = canonical_from_aligned(Aligned(*orbits), alpha0, beta0)
    # theta1 is known modulo 4 pi: it begins on the sheet of which the separatrix is the middle, and
    # a curve that leaves it, in a window that is wider, goes on without a jump.
    centre, sheet = float(alpha0 + beta0), 4 * math.pi
    off = np.mod(c.theta1 - centre + sheet / 2, sheet) - sheet / 2
    return centre + np.unwrap(off, axis=0, period=sheet), c.J1 / c.J2


def points(x: Array, y: Array) -> NDArray[np.intp]:
    """Choose points of a polygon with |x| < 1: many where it bends, few where it is straight.

    A chord h of a curve with curvature c is at most c h^2/8 away. So the curve needs as many
    points as the integral of sqrt(c/(8 CHORD)) over its length says; in a polygon c is the
    turn at a point over the length there.
    """
    outside = np.flatnonzero(np.abs(x) > 1)
    # The first point outside belongs to it, so that the curve ends at the panel's edge and not at
    # the last sample inside.
    n = int(outside[0]) + 1 if outside.size else x.size
    # As complex numbers: the angle of their quotient is the turn, with no jump at pi.
    step = np.diff(x[:n]) + 1j * np.diff(y[:n])
    turn = np.abs(np.angle(step[1:] * step[:-1].conj()))
    length = (np.abs(step[1:]) + np.abs(step[:-1])) / 2
    needed = np.cumsum(np.sqrt(turn * length / (8 * CHORD)))
    # A point is kept wherever the count of needed points passes a whole number.
    inner = 1 + np.flatnonzero(np.diff(np.floor(needed), prepend=0.0))
    return np.concatenate(([0], inner, [n - 1]))
