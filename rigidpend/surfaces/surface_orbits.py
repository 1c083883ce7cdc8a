"""Orbits of S1-, the unstable manifold of the lower periodic orbit, up to the section J1 = J2/2."""

import math
from collections.abc import Iterable
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidpend.mechanics.body import Angles, Body
from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.equations import (
    AlignedCoefficients,
    aligned_coefficients,
    hamiltonian_J3_0,
)
from rigidpend.mechanics.free_body import SeparatrixMotion, exponent, theta1
from rigidpend.numbers import Numbers, Scalar
from rigidpend.numbers.exact import GUARD_BITS, Exact, context, fraction
from rigidpend.orbits.integrate.arithmetic import Arithmetic
from rigidpend.orbits.integrate.states import first_crossings
from rigidpend.orbits.precision import MOST_IN_PAIRS, Precision, precision
from rigidpend.surfaces.melnikov import delta

LONGEST_WAIT = 4
"""Longest time allowed up to the section, in units of the unperturbed motion's time.

Orbits close to the unperturbed motion need about one unit."""


class UnstableSurface(NamedTuple):
    """The surface S1- beside separatrix 2, at J3 = 0 and one energy."""

    p: Angles
    """Angles of the body, with guard bits; beta0 < 0 if separatrix 1 is in the place of 2."""
    h0: Any
    """Energy constant of all orbits of the surface, physical units."""
    bits: int
    """Working precision of the integration."""


class Points(NamedTuple):
    """Points of orbits on the section: arrays (n,) of doubles, or of numbers with guard bits."""

    phase: Any
    """Phase g = theta1/2 + theta2, radians.

    The first is within half a turn of the unperturbed motion's; then its advance is continuous."""
    advance: Any
    """Phase less that of the unperturbed motion, radians, with a smaller error than the phase."""
    offset: Any
    """Offset theta1 - alpha0 - beta0 from the separatrix, radians."""
    time: Any
    """Time t' from the start to the section."""


def surface(body: Body, h0: Exact, bits: int, separatrix: int = 2) -> UnstableSurface:
    """Make S1- of a body beside separatrix 2, or the surface beside separatrix 1 in its place.

    The reflection in the plane normal to the second axis, by which r2 becomes -r2, takes Qm to -Qp
    and theta3 to -theta3. So separatrix 1 of a body is separatrix 2 of the body with -beta0. The
    turn by pi about the third axis together with the reflection of gamma3, theta1 to theta1 + 2 pi,
    takes 2 to 4, 1 to 3 and theta3 to -theta3.
    """
    p = body.angles(bits + GUARD_BITS)
    side = {2: 1, 1: -1}[separatrix]
    return UnstableSurface(p._replace(beta0=side * p.beta0), h0.at(bits + GUARD_BITS), bits)


def numbers(bits: int) -> Any:
    """The mpmath context of a working precision with guard bits."""
    return context(bits + GUARD_BITS)


def J2_0(s: UnstableSurface) -> Any:
    """J2 of the unperturbed motion, sqrt(2 h0/kappa), dimensionless."""
    return numbers(s.bits).sqrt(2 * s.h0 / s.p.kappa)


def launch(s: UnstableSurface, theta2_0: Scalar, depth: Scalar) -> list[Fraction]:
    """The start of an orbit, as aligned components rounded to the working precision.

    See :func:`launches`."""
    a = guarded(s.bits)
    return [fraction(x, s.bits) for x in launches(s, a.array([theta2_0]), depth, a)[:, 0]]


def launches(s: UnstableSurface, theta2_0: Any, depth: Scalar, a: Precision) -> Any:
    """Starts of orbits with phases theta2_0, in aligned components (6, n), at -ln(J1/J2) = `depth`.

    At theta1 = alpha0 + beta0 they lie near S1-, not on it. Their distance from it shrinks as J1
    grows: at the section it is a share exp(-depth) of mu (dtheta).

    With J1/J2 given the momenta are proportional to J2, and the energy is a multiple of J2^2 plus
    the weight's part. This part and gamma are linear in the cosine and sine of theta2_0.
    """
    m, p = numbers(s.bits), s.p
    low, zero, one = m.exp(-depth), m.mpf(0), m.mpf(1)
    # Factors of the cosine and the sine of theta2_0 in gamma and in the weight's energy, at J2 = 1.
    # So a start takes few operations in long numbers, however many there are.
    axes = []
    for theta2 in (zero, m.pi / 2):
        angles = (theta1(2, p, m), theta2)
        unit = aligned_from_canonical(
            Canonical(low, 1 - low, zero, *angles, zero, one), p.alpha0, p.beta0, m
        )
        kinetic = hamiltonian_J3_0(low, one, angles, p._replace(mu=zero), m)
        axes.append((*unit[3:], hamiltonian_J3_0(low, one, angles, p, m) - kinetic))
    cos, sin = a.cos(theta2_0), a.sin(theta2_0)
    *gamma, weight = (a.number(x) * cos + a.number(y) * sin for x, y in zip(*axes, strict=True))
    J2 = a.sqrt((a.number(s.h0) - weight) / a.number(kinetic))
    # Qm is zero on separatrix 2.
    return np.stack((a.number(unit.Qp) * J2, 0 * J2, a.number(unit.M3) * J2, *gamma))


def lag(s: UnstableSurface, depth: Scalar) -> Any:
    """The phase g at the section less theta2_0, of unperturbed motions, radians in [-pi, pi]."""
    m, J2 = numbers(s.bits), J2_0(s)
    low = m.exp(-depth) * J2
    whole = delta(SeparatrixMotion(2, low, J2 - low, m.mpf(0)), s.p, m)
    return whole - 2 * m.pi * m.nint(whole / (2 * m.pi))


def coefficients(s: UnstableSurface) -> AlignedCoefficients:
    """The coefficients of the aligned equations, rounded to the working precision."""
    exact = aligned_coefficients(s.p, numbers(s.bits))
    return AlignedCoefficients(*(fraction(x, s.bits) for x in exact))


def meet(
    s: UnstableSurface,
    theta2_0: Iterable[Any],
    depth: Scalar,
    arithmetic: Arithmetic,
    jobs: int = 1,
) -> Points | None:
    """Follow orbits of S1- to the section, from phases and a depth as in :func:`launches`.

    The tolerance holds for 53 bits; every further bit halves it. None if an orbit does not come to
    the section, or not beside separatrix 2.
    """
    a, m = kind(s, arithmetic), numbers(s.bits)
    starts = list(theta2_0)
    begin = a.array(starts)
    rate = exponent(J2_0(s), s.p, m)
    limit = LONGEST_WAIT * float((depth + math.tau) / rate)
    states, numbers_of = launches(s, begin, depth, a), coefficients(s)
    if a.bits == 53:
        numbers_of = AlignedCoefficients(*map(float, numbers_of))
    else:
        states = np.frompyfunc(lambda x: fraction(x, s.bits), 1, 1)(states)
    found = first_crossings(
        numbers_of,
        states,
        limit,
        engine=arithmetic.engine,
        bits=s.bits,
        tolerance=arithmetic.tolerance,
        jobs=jobs,
    )
    if found is None:
        return None
    time, state = found if a.bits == 53 else map(a.array, found)
    # Beside separatrix 2 the orbit crosses with Qp > 0.
    if (state[0] < 0).any():
        return None
    alpha0, sin_alpha0 = a.number(s.p.alpha0), a.number(m.sin(s.p.alpha0))
    phase, offset = section_angles(state, alpha0, sin_alpha0, a)
    behind, turn = lag(s, depth), 2 * a.pi
    unperturbed_phases = [start + behind for start in starts]
    expected = a.array(unperturbed_phases)
    # g less the unperturbed phase is a continuous function of theta2_0, of no winding: each orbit's
    # is next to the one before. With much weight it may be anywhere, also beside half a turn.
    off = a.floats((phase - expected) / turn)
    phase = phase + turn * (np.rint(np.unwrap(off, period=1) - off) - np.rint(off[0]))
    # The unperturbed phases have more bits than the doubles nearest to them: `rest` is the error of
    # these, which the phase less `expected`, a small difference, would be off by.
    rest = a.array([x - near for x, near in zip(unperturbed_phases, expected, strict=True)])
    return Points(phase, (phase - expected) - rest, offset, time)


def kind(s: UnstableSurface, arithmetic: Arithmetic) -> Precision:
    """The numbers in which points are given: the kernel's doubles, or numbers with guard bits."""
    doubles = s.bits == 53 and arithmetic.engine == "taylor"
    return precision(53) if doubles else guarded(s.bits)


def guarded(bits: int) -> Precision:
    """The numbers of a working precision with guard bits, as arrays of mpmath's numbers."""
    return precision(max(bits + GUARD_BITS, MOST_IN_PAIRS + 1))


def section_angles(state: Numbers, alpha0: Scalar, sin_alpha0: Scalar, m: Any) -> tuple[Any, Any]:
    """The phase g and the offset, radians, of states with M3 = 0 and J3 = 0 beside separatrix 2.

    There Qm = J2 sin(offset/2) and Qp = J2 sin(offset/2 + alpha0), so that a small offset keeps the
    relative precision of Qm and of `sin_alpha0`, which the sine of a rounded alpha0 near pi lacks.
    """
    Qp, Qm, _, gamma1, gamma2, gamma3 = state
    # Both arguments are J2 sin(alpha0) times the sine and the cosine of half the offset.
    half = m.atan2(Qm * sin_alpha0, Qp - Qm * m.cos(alpha0))
    l = half + alpha0 / 2
    return m.atan2(gamma1 * m.cos(l) - gamma2 * m.sin(l), -gamma3), 2 * half
