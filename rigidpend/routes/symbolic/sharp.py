"""theta2_0 of doubly asymptotic orbits to 30 digits, by integration of many at once.

Orbits start on the unstable surface of the lower periodic orbit, close to that orbit, where the
surface is flat. At J1 = 1e-24 the surface in doubles, theta1 as a function of theta2, is wrong by
1e-16 relative to a distance of 1e-12, so that an orbit starts with an invariant I of 1e-40 instead
of 0. J1 and theta2 are exact there, and J2 follows from the energy in any precision. theta1 is a
linear function of theta2 beside an anchor, so that its roundings do not change with theta2. From
there up to a larger J1 the orbit is integrated.

An orbit is integrated from its start until it is close to the periodic orbit at its end. There the
normal form gives the invariant I of the passage, which is 0 if the orbit is asymptotic, and the map
gives the derivative of I in theta2. The closer to the end I is measured, the smaller it may be:
computed in doubles, it errs by 1e-16 of the square of the distance.

The less the surfaces are split, the more a rounding displaces an orbit along them. 106 bits serve
where that is little, and twice as many elsewhere.
"""

import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.equations import AlignedCoefficients, eq1, hamiltonian_J3_0
from rigidpend.numbers import Array, Numbers
from rigidpend.numbers.exact import GUARD_BITS, Exact, fraction
from rigidpend.orbits.integrate.arithmetic import DEFAULT_ENGINE, FINEST_TOLERANCE, PAIRS
from rigidpend.orbits.integrate.kernel.lane_numbers import exactly
from rigidpend.orbits.integrate.states import at_crossings, states_at
from rigidpend.orbits.precision import precision, rounded
from rigidpend.orbits.return_map import MapError
from rigidpend.orbits.return_map.poincare import rotation_phase
from rigidpend.orbits.return_map.reduced import coefficients, lift, reduced
from rigidpend.routes.symbolic.asymptotic import DoublyAsymptotic
from rigidpend.routes.symbolic.chain import NoOrbit
from rigidpend.routes.symbolic.levels import STEP, ChainLevel

DEPTH = Fraction(1, 10**16)
"""J1 of the starts over J1_0. Orbits start with I of 1e-16 of J1, and theta2_0 errs by I/J1_0."""
HIGHEST = Fraction(1, 10**20)
"""Largest J1 of the starts over the splitting: 1e-16 of it displaces an orbit by 1e-36 rad."""
MOST_ITERATIONS = 60
"""Largest number of iterations for a point of the surface in doubles."""
FIRST_ERROR = 1e-12
"""Largest error of b by the map in doubles, radians, where its roundings do not count."""
GAINED = 1e-6
"""Largest share of an error that a correction leaves.

Where more than ten times as much is left, the correction is measured anew, farther from the end."""
NEAREST, FARTHEST = 1e-15, 1e-2
"""Limits of the places where orbits end: least v^2 over the slope of I, and largest v.

v is the coordinate of the normal form."""
ROUNDS = 16
"""Largest number of measurements of I."""
OUTSIDE, NEAR = 1e-3, 1e-12
"""Share of J1_0 by which J1 may be off where the normal form has it, and as two steps mend it.

The normal form has as many terms as the layer needs, so that a larger J1_0 is put less well."""
CORRECTIONS = 4
"""Largest number of integrations to J1_0: each squares what the one before has left."""
FINEST_ERROR = 3e-30
"""Largest error that is left, radians: a third of the 30th digit."""


class Anchors(NamedTuple):
    """Starts in doubles, radians, (N,) each, about which theta1 is linear in theta2."""

    theta2: Array
    offset: Array
    """theta1 less alpha0 + beta0, so that a thin body's keeps digits, whose alpha0 is near pi."""
    slope: Array
    """Derivative of theta1 in theta2 on the surface."""
    b_slope: Array
    """Derivative of the angle b in theta2 on the surface."""


def integration_bits(displaced: float) -> int:
    """Bits of the integration, where roundings in pairs displace an orbit by so many radians."""
    return 2 * PAIRS if displaced > FINEST_ERROR else PAIRS


class Launch:
    """Orbits on the unstable surface of a level, each given by its theta2 where J1 is tiny.

    theta2_0 is their theta2 where J1 has grown to J1_0, dimensionless. `bits` are those of the
    integration.
    """

    def __init__(self, level: ChainLevel, J1_0: Exact) -> None:
        self.level, self.bits = level, integration_bits(level.displaced(PAIRS))
        bits = self.bits + 2 * GUARD_BITS
        self.a, self.p = precision(bits), level.body.angles(bits)
        self.h, self.J1_0 = level.energy.at(bits), J1_0.at(bits)
        depth, highest = map(self.a.number, (DEPTH, HIGHEST))
        self.J1 = min(self.J1_0 * depth, level.splitting * highest)
        self.c = coefficients(self.p, "1", self.a)
        self.fractions = AlignedCoefficients(*(fraction(x, self.bits) for x in self.c.aligned))
        self.doubles = rounded(self.c, precision(53))
        self.zero_phase = self.a.pi / 2 - self.p.beta0 / 2

    def theta2(self, b: Array, J1: float) -> Array:
        """theta2 of orbits with angles b where their action is J1, radians, in doubles."""
        # Fixed-point iteration of b = -psi - ln(v)/Lambda, in which v depends weakly on psi.
        psi = -b
        for _ in range(MOST_ITERATIONS):
            before, psi = psi, -b - np.log(self._beside(psi, J1)[0]) / self.level.exponent
            if np.abs(psi - before).max(initial=0.0) < 4e-15 * (1 + np.abs(psi).max(initial=0.0)):
                break
        return np.asarray(float(self.zero_phase) - psi)

    def b(self, theta2: Array, J1: float) -> Array:
        """The angle b on the surface, radians: the inverse of :meth:`theta2`."""
        psi = float(self.zero_phase) - theta2
        return np.asarray(-psi - np.log(self._beside(psi, J1)[0]) / self.level.exponent)

    def anchors(self, b: Array) -> Anchors:
        """The starts, in doubles, of orbits with angles b on the surface."""
        J1 = float(self.J1)
        theta2 = self.theta2(b, J1)
        # psi falls as theta2 grows, hence the order of the two neighbours.
        psi = float(self.zero_phase) - theta2
        here, low, high = (self._beside(psi - x, J1)[1] for x in (0.0, -STEP, STEP))
        b_slope = (self.b(theta2 + STEP, J1) - self.b(theta2 - STEP, J1)) / (2 * STEP)
        return Anchors(theta2, here, (high - low) / (2 * STEP), b_slope)

    def clock(self, b: Array, J1: float) -> Array:
        """t' at which the action of orbits is J1, since theta2 = zero_phase at vanishing J1."""
        psi = float(self.zero_phase) - self.theta2(b, J1)
        rotation = self.level.rates(np.zeros(1)).rotation
        return np.asarray(-(self._beside(psi, J1)[2] + rotation * psi))

    def states(self, anchors: Anchors, theta2: Numbers) -> Numbers:
        """The starts (6, N) at phases theta2, (N,), near the anchors; all are Fractions."""
        a, p = self.a, self.p
        begun, offset, slope = exactly([anchors[:3]])
        theta1 = p.alpha0 + p.beta0 + a.array(offset + slope * (theta2 - begun))
        angles = theta1, a.array(theta2)
        J2 = a.sqrt(2 * (self.h - p.mu * a.sin(angles[1])) / p.kappa)
        left = 1.0
        # Simplified Newton's method for J2 at the energy h: each step multiplies the error by about
        # mu J1, for the derivative leaves that out.
        while left > 2.0 ** (-self.bits // 2):
            off = hamiltonian_J3_0(self.J1, J2, angles, p, a) - self.h
            J2, left = J2 - off / (p.kappa * J2), a.largest(off / self.h)
        at = Canonical(self.J1, J2 - self.J1, 0, *angles, 0, 1)
        found = np.broadcast_arrays(*aligned_from_canonical(at, p.alpha0, p.beta0, a))
        return np.frompyfunc(lambda x: fraction(x, self.bits), 1, 1)(np.array(found))

    def carried(self, states: Numbers, times: Array, jobs: int = 1) -> Any:
        """States (6, N), Fractions, of orbits after a time t' for each, (N,)."""
        return states_at(self.fractions, states, exactly([times])[None], self.bits, jobs)[:, 0]

    def flight(self, states: Numbers, begun: Array, flight: Array, jobs: int = 1) -> Array:
        """t' from the first crossings to the last, (N,), to the rounding of doubles.

        `begun` and `flight` are the map's t' from the starts to the first crossings, and from these
        to the last. They are displaced by the map's roundings, the more the less the surfaces are
        split.
        """
        first, early = self._crossed(states, begun, jobs)
        _, late = self._crossed(first, flight - early, jobs)
        return np.asarray(flight - early + late)

    def _crossed(self, states: Numbers, times: Array, jobs: int) -> tuple[Numbers, Array]:
        """States (6, N) at the crossings near t' = `times`, and how much later these are, t'."""
        given = self.fractions, states, times, self.bits, FINEST_TOLERANCE[DEFAULT_ENGINE]
        late = 2.0 ** (2 - self.bits)
        at, there, _ = at_crossings(*given, late, engine=DEFAULT_ENGINE, jobs=jobs)
        return there, (at - exactly([times])).astype(float)

    def _beside(self, psi: Array, J1: float) -> tuple[Array, Array, Array]:
        """v, theta1 and the oscillation of the time where orbits of the surface have psi and J1.

        (N,) each; psi is that of the mirrored orbits, for which the surface is u = 0. theta1 comes
        less alpha0 + beta0.
        """
        made, zero, k = self.level.map_level, 0 * psi, self.doubles.aligned
        # Qp without weight, for a J1 far below J2: 2 sqrt(J1 J2) sin(alpha0).
        v = zero + 4 * k.half_sigma * math.sqrt(J1 * math.sqrt(2 * self.level.h / k.kappa))
        for _ in range(MOST_ITERATIONS):
            Qp, Qm, tau = made.placed(psi, zero, v)
            M1, M2 = self.doubles.momenta(Qp, Qm)
            here = self._action(psi, Qp, Qm, M1, M2)
            # J1 is nearly proportional to v^2.
            v = v * np.sqrt(J1 / here)
            if np.abs(here / J1 - 1).max(initial=0.0) < 1e-15:
                break
        # Qm = J sin(half) and Qp = J sin(half + alpha0), where half is half of the offset.
        across, ahead = 2 * k.half_sigma * Qm, Qp - Qm * math.cos(self.p.alpha0)
        return v, 2 * np.atan2(across, ahead), tau

    def _action(self, psi: Array, Qp: Array, Qm: Array, M1: Array, M2: Array) -> Array:
        """J1 from M and the energy, of the mirrored orbits, which have M3 > 0."""
        c, across, turn = self.doubles, M1 * M1 + M2 * M2, (np.cos(psi), np.sin(psi))
        high, drop = self.level.h - lift(turn, c) + Qp * Qm / 2, 0 * across
        # The energy tells J2 but for `drop`, which is about mu J1 and depends on J2 itself.
        for _ in range(MOST_ITERATIONS):
            before, J2 = drop, np.sqrt(2 * (high + drop) / c.aligned.kappa)
            square = J2 * J2 - across
            # The series of the normal form, far from its orbit, no longer have the energy h.
            if not (square > 0).all():
                raise self._outside()
            M3 = np.sqrt(square)
            drop = reduced((Qp, Qm), turn, (J2, M3, 1 / J2, 1 / (J2 + M3)), c).drop
            if np.abs(drop - before).max(initial=0.0) < 1e-16 * self.level.h:
                break
        # J1 = (J2 - M3)/2 without the difference, of which tiny J1 leaves nothing.
        return np.asarray(across / (2 * (J2 + M3)))

    def at_J1_0(self, begin: Array, states: Numbers, jobs: int) -> list[Fraction]:
        """theta2_0 in [0, 2 pi) of orbits: their theta2 where J1 has grown to J1_0.

        `begin` is theta2 at the start in doubles, and `states` are the starts, (6, N).
        """
        b = self.b(begin, float(self.J1))
        left = self.clock(b, float(self.J1_0)) - self.clock(b, float(self.J1))
        for _ in range(CORRECTIONS):
            states = self.carried(states, left, jobs)
            here = self._canonical(states)
            off = np.abs((here[1] / self.J1_0 - 1).astype(float)).max(initial=0.0)
            if off < NEAR:
                break
            if not off < OUTSIDE:
                raise self._outside()
            left = self._left(here).astype(float)
        wide: Any = self.a
        # Midpoint steps in time, from J1 here to J1_0. The first leaves about the cube of `NEAR`,
        # the second nothing.
        for _ in range(2):
            time, rates = self._left(here), eq1(here, self.p, wide)
            middle = tuple(x + time / 2 * rate for x, rate in zip(here, rates, strict=True))
            rates = eq1(middle, self.p, wide)
            here = tuple(x + time * rate for x, rate in zip(here, rates, strict=True))
        return [fraction(x, self.bits) for x in here[2] % (2 * self.a.pi)]

    def _left(self, here: Any) -> Any:
        """t' to where J1 is J1_0 from `here`, theta1, J1, theta2 and J2, by the rate of J1."""
        wide: Any = self.a
        return (self.J1_0 - here[1]) / eq1(here, self.p, wide)[1]

    def _outside(self) -> MapError:
        J1 = f"J1_0 = {float(self.J1_0):g}"
        return MapError(f"{J1} lies outside of the normal form: take a smaller one")

    def _canonical(self, states: Any) -> tuple[Any, Any, Any, Any]:
        """theta1, J1, theta2 and J2 of states (6, n), in all bits."""
        a = self.a
        Qp, Qm, M3, gamma1, gamma2, gamma3 = a.array(states)
        # The reversor, for `rotation_phase` knows the upper orbit alone.
        image = np.stack((Qp, Qm, -M3, gamma1, gamma2, -gamma3))
        theta2 = self.zero_phase - rotation_phase(image, self.c, a)
        M1, M2 = self.c.momenta(Qp, Qm)
        J2 = a.sqrt(M1 * M1 + M2 * M2 + M3 * M3)
        J1 = (M1 * M1 + M2 * M2) / (2 * (J2 - M3))
        return self.p.beta0 + 2 * a.atan2(M1, M2), J1, theta2, J2


class Sharp(NamedTuple):
    """Doubly asymptotic orbits whose phases have 30 digits, N of them."""

    theta2_0: list[Fraction]
    """theta2 where J1 is J1_0, radians in [0, 2 pi), (N,)."""
    starts: Numbers
    """Aligned components at the starts of `Launch`, Fractions, (6, N)."""
    moved: Array
    """Corrections by integration of the map's theta2 at the starts, radians, (N,)."""
    error: Array
    """Largest errors of the phases, radians, (N,): by the last correction or by roundings."""
    flight: Array
    """t' from the first crossings to the last, (N,)."""


def sharp(launch: Launch, orbits: DoublyAsymptotic, jobs: int = 1) -> Sharp:
    """Refine the phases of doubly asymptotic orbits that the map has found in doubles.

    NoOrbit is raised where integration finds an orbit elsewhere than the map, or where corrections
    do not become small.
    """
    # Newton's method for I = 0 with the map's derivative at first, then secants.
    begun, error = launch.anchors(orbits.b), max(FIRST_ERROR, launch.level.displaced(53))
    slope = orbits.I_slope * begun.b_slope
    theta2 = exactly([begun.theta2])
    I_before = step = np.zeros_like(slope)
    for rounds in range(ROUNDS):
        states = launch.states(begun, theta2)
        # Orbits of the expected error have I of slope times error. Measured at this distance, I is
        # then as large as its square, of which doubles resolve 1e-16.
        distance = np.sqrt(np.abs(orbits.I_slope) * max(error, NEAREST)).clip(max=FARTHEST)
        I = _invariant(launch, orbits, states, distance, jobs)
        # The map's derivatives err, the more the less the surfaces are split: secants correct them,
        # except where a step is so small that the change of I is not resolved.
        told = np.abs(step) > max(GAINED * np.abs(step).max(initial=0.0), FINEST_ERROR)
        slope[told] = (I - I_before)[told] / step[told]
        wanted = -I / slope
        last = float(np.abs(wanted).max(initial=0.0))
        if last > 10 * error and not rounds:
            raise NoOrbit(f"integration finds an orbit {last:.2g} rad from where the map has it")
        if last > 10 * error:
            # The correction before gained less than was expected, and the orbit has left its end at
            # the chosen distance. I is measured again at a larger one before it is corrected.
            error = last
            continue
        I_before, step = I, wanted
        theta2 = theta2 + exactly([step])
        if last < FINEST_ERROR:
            break
        error = max(last * GAINED, FINEST_ERROR)
    else:
        raise NoOrbit(f"theta2_0 does not settle below {last:.2g} rad")
    moved = (theta2 - exactly([begun.theta2])).astype(float)
    states = launch.states(begun, theta2)
    theta2_0 = launch.at_J1_0(begun.theta2 + moved, states, jobs)
    left = max(launch.level.displaced(launch.bits), math.ldexp(NEAREST, -51))
    flight = launch.flight(states, _begun(launch, orbits), orbits.flight, jobs)
    return Sharp(theta2_0, states, moved, np.abs(step).clip(left), flight)


def _begun(launch: Launch, orbits: DoublyAsymptotic) -> Array:
    """t' from the starts of `Launch` to the first crossings, by the map, (N,)."""
    return orbits.begun - launch.clock(orbits.b, float(launch.J1))


def _invariant(
    launch: Launch, orbits: DoublyAsymptotic, states: Numbers, distance: Array, jobs: int
) -> Array:
    """I of the passages in which orbits end, measured at a distance from that periodic orbit, (N,).

    The distances are v of the normal form, (N,).
    """
    level, upper = launch.level, len(orbits.symbols) % 2 == 0
    times = _begun(launch, orbits) + orbits.flight + orbits.faded(distance)
    at = launch.carried(states, times, jobs).astype(float)
    if not upper:
        # The reversor takes the lower orbit to the upper one; it exchanges u and v, and keeps I.
        at[[2, 5]] *= -1
    made = level.map_level
    psi = rotation_phase(at, launch.doubles, made.a)
    if not (np.hypot(at[0], at[1]) < math.sqrt(FARTHEST)).all():
        raise NoOrbit("an orbit leaves the periodic orbit before its end")
    beside = made.inverted(psi, at[0], at[1])
    return np.asarray(beside.u * beside.v)
