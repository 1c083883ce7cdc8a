"""theta2_0 of doubly asymptotic orbits to 30 digits, by integration of many at once.

Orbits start on the unstable surface itself: they have left the lower orbit since for ever. Close
to the periodic orbit the surface is flat: where J1 is 1e-24, theta1 in doubles is off it by 1e-16
of 1e-12, and so is the orbit by an invariant I of 1e-40. J1 and theta2 are exact there, and J2
follows from the energy in as many bits as one likes. theta1 is straight in theta2 beside an
anchor, lest its roundings move the orbits. What an orbit does from there up to a larger J1 is
integrated.

An orbit is integrated from its start until it is close to the periodic orbit at its end. There
the normal form tells the invariant I of the passage, which is 0 if the orbit is asymptotic, and
the map tells by how much I changes with theta2. The closer to the end, the smaller an I is told:
what doubles make of it errs by 1e-16 of the square of the distance.

The less the surfaces are split, the more a rounding displaces an orbit along them. So 106 bits
serve where that is little, and twice as many elsewhere.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.equations import AlignedCoefficients, aligned, eq1, hamiltonian_J3_0
from rigidpend.numbers.exact import GUARD_BITS, Exact, context, fraction
from rigidpend.numbers.generic import Array, Numbers
from rigidpend.orbits.integrate.arithmetic import PAIRS
from rigidpend.orbits.integrate.kernel.lane_numbers import exactly
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map.poincare import rotation_phase
from rigidpend.orbits.return_map.precision import precision
from rigidpend.orbits.return_map.reduced import coefficients
from rigidpend.routes.symbolic.asymptotic import DoublyAsymptotic
from rigidpend.routes.symbolic.chain import NoOrbit
from rigidpend.routes.symbolic.levels import Level

DEPTH = Fraction(1, 10**16)
"""J1 of the starts over J1_0: 1e-16 of it is how far off the surface theta2_0 is told."""
HIGHEST = Fraction(1, 10**20)
"""J1 of the starts over the splitting, at most: 1e-16 of it displaces an orbit by 1e-36 rad."""
MOST_ITERATIONS = 60
STEP = 1e-4
"""Step of the derivative of b in theta2, radians."""
FIRST_ERROR = 1e-12
"""Error of b by the map in doubles, radians, at most, where its roundings do not count."""
GAINED = 1e-6
"""Share of an error that a correction leaves, at most.

Where ten times that is left, the next correction is told once more, farther from the end."""
NEAREST, FARTHEST = 1e-15, 1e-2
"""Ends of orbits, by v of the normal form: v^2 over the slope of I at least, and v at most."""
ROUNDS = 16
CROSSING_STEPS = 2
"""Newton's steps to a crossing: from 1e-4 off, a hundred times what an orbit may be displaced."""
FINEST = 3e-30
"""Error that is left at most, radians: a third of the 30th digit."""


class Anchors(NamedTuple):
    """Starts in doubles, (N,) each: those nearby have theta1 on a straight line through them.

    With the derivatives in theta2, on the surface, of theta1 and of the angle b.
    """

    theta2: Array
    theta1: Array
    slope: Array
    b_slope: Array


class Launch:
    """Orbits of the surface of a level, by theta2 where J1 is tiny.

    J1_0 is where theta2_0 is told, dimensionless; `bits` are those of the integration.
    """

    def __init__(self, level: Level, J1_0: Exact) -> None:
        self.level, self.bits = level, PAIRS
        if level.displaced(PAIRS) > FINEST:
            self.bits *= 2
        bits = self.bits + 2 * GUARD_BITS
        self.a, self.p, m = precision(bits), level.body.angles(bits), context(bits)
        self.h, self.J1_0 = level.energy.in_context(m), J1_0.in_context(m)
        depth, highest = map(self.a.number, (DEPTH, HIGHEST))
        self.J1 = min(self.J1_0 * depth, level.splitting * highest)
        self.c = coefficients(self.p, "1", self.a)
        self.fractions = AlignedCoefficients(*(fraction(x, self.bits) for x in self.c.aligned))
        self.doubles = coefficients(level.body.angles(), "1", precision(53))
        self.zero_phase = self.a.pi / 2 - self.p.beta0 / 2

    def theta2(self, b: Array, J1: float) -> Array:
        """theta2 of orbits where their action is J1, in doubles."""
        psi = -b
        for _ in range(MOST_ITERATIONS):
            before, psi = psi, -b - np.log(self._beside(psi, J1)[0]) / self.level.exponent
            if np.abs(psi - before).max(initial=0.0) < 4e-15 * (1 + np.abs(psi).max(initial=0.0)):
                break
        return np.asarray(float(self.zero_phase) - psi)

    def b(self, theta2: Array, J1: float) -> Array:
        """The angle on the surface, the inverse of :meth:`theta2`."""
        psi = float(self.zero_phase) - theta2
        return np.asarray(-psi - np.log(self._beside(psi, J1)[0]) / self.level.exponent)

    def anchors(self, b: Array) -> Anchors:
        """The starts of orbits by their angles on the surface."""
        J1 = float(self.J1)
        theta2 = self.theta2(b, J1)
        psi = float(self.zero_phase) - theta2
        here, low, high = (self._beside(psi - x, J1)[1] for x in (0.0, -STEP, STEP))
        b_slope = (self.b(theta2 + STEP, J1) - self.b(theta2 - STEP, J1)) / (2 * STEP)
        return Anchors(theta2, here, (high - low) / (2 * STEP), b_slope)

    def clock(self, b: Array, J1: float) -> Array:
        """t' of orbits where their action is J1; theta2 = zero_phase at tiny J1 is the origin."""
        psi = float(self.zero_phase) - self.theta2(b, J1)
        rotation = self.level.rates(np.zeros(1)).rotation
        return np.asarray(-(self._beside(psi, J1)[2] + rotation * psi))

    def states(self, anchors: Anchors, theta2: Numbers) -> Numbers:
        """The starts (6, N) at theta2 (N,) beside the anchors, all in Fractions."""
        a, p = self.a, self.p
        begun, theta1, slope = exactly([anchors[:3]])
        angles = a.array(theta1 + slope * (theta2 - begun)), a.array(theta2)
        J2 = a.sqrt(2 * (self.h - p.mu * a.sin(angles[1])) / p.kappa)
        left = 1.0
        # Each time it is less by mu J1.
        while left > 2.0 ** (-self.bits // 2):
            off = hamiltonian_J3_0(self.J1, J2, angles, p, a) - self.h
            J2, left = J2 - off / (p.kappa * J2), a.largest(off / self.h)
        at = Canonical(self.J1, J2 - self.J1, 0, *angles, 0, 1)
        found = np.broadcast_arrays(*aligned_from_canonical(at, p.alpha0, p.beta0, a))
        return np.frompyfunc(lambda x: fraction(x, self.bits), 1, 1)(np.array(found))

    def carried(self, states: Numbers, times: Array, jobs: int = 1) -> Any:
        """Orbits carried on, each for a time t' of its own: (6, N) Fractions."""
        return states_at(self.fractions, states, exactly([times])[None], self.bits, jobs)[:, 0]

    def flight(self, states: Numbers, begun: Array, flight: Array, jobs: int = 1) -> Array:
        """t' from the first crossings to the last, from about when these are to doubles' rounding.

        The map is displaced by its roundings, and crossings with it, the more the less the surfaces
        are split.
        """
        first, early = self._crossed(states, begun, jobs)
        _, late = self._crossed(first, flight - early, jobs)
        return np.asarray(flight - early + late)

    def _crossed(self, states: Numbers, times: Array, jobs: int) -> tuple[Numbers, Array]:
        """Orbits at crossings that are about so much later, and by how much more, t'."""
        at, moved = self.carried(states, times, jobs), np.zeros_like(times)
        for _ in range(CROSSING_STEPS):
            here = at.astype(float)
            more = -here[2] / aligned(here, self.doubles.aligned)[2]
            at, moved = self.carried(at, more, jobs), moved + more
        return at, moved

    def _beside(self, psi: Array, J1: float) -> tuple[Array, Array, Array]:
        """v, theta1 and the oscillation of the time, at psi of the mirrored orbits."""
        made, zero = self.level.map_level, 0 * psi
        v = np.full(len(psi), np.sqrt(J1))
        for _ in range(MOST_ITERATIONS):
            Qp, Qm, tau = made.placed(psi, zero, v)
            M1, M2 = (Qp + Qm) * self.doubles.to_M1, (Qp - Qm) * self.doubles.to_M2
            here = self._action(psi, Qp, Qm, M1, M2)
            v = v * np.sqrt(J1 / here)
            if np.abs(here / J1 - 1).max(initial=0.0) < 1e-15:
                break
        theta1 = float(self.p.beta0) + 2 * np.atan2(M1, M2)
        return v, theta1, tau

    def _action(self, psi: Array, Qp: Array, Qm: Array, M1: Array, M2: Array) -> Array:
        """J1 from M and the energy, with M3 as positive as the mirrored orbits have it."""
        k, across = self.doubles.aligned, M1 * M1 + M2 * M2
        lifted = k.mu_r1 * np.cos(psi) - k.mu_r2 * np.sin(psi)
        J2 = np.sqrt(2 * (self.level.h - lifted + Qp * Qm / 2) / k.kappa)
        return np.asarray(across / (2 * (J2 + np.sqrt(J2 * J2 - across))))

    def at_J1_0(self, begin: Array, states: Numbers, jobs: int) -> list[Fraction]:
        """theta2_0, in [0, 2 pi): theta2 where J1 has grown to J1_0, of orbits from theta2 on."""
        b = self.b(begin, float(self.J1))
        times = self.clock(b, float(self.J1_0)) - self.clock(b, float(self.J1))
        found = self._moved(self.carried(states, times, jobs)) % (2 * self.a.pi)
        return [fraction(x, self.bits) for x in found]

    def _moved(self, states: Any) -> Any:
        """theta2 where J1 is J1_0 sharply, from states (6, n) a rounding of doubles beside."""
        a = self.a
        Qp, Qm, M3, gamma1, gamma2, gamma3 = a.array(states)
        image = np.stack((Qp, Qm, -M3, gamma1, gamma2, -gamma3))
        theta2 = self.zero_phase - rotation_phase(image, self.c, a)
        M1, M2 = (Qp + Qm) * self.c.to_M1, (Qp - Qm) * self.c.to_M2
        J2 = a.sqrt(M1 * M1 + M2 * M2 + M3 * M3)
        J1 = (M1 * M1 + M2 * M2) / (2 * (J2 - M3))
        here = (self.p.beta0 + 2 * a.atan2(M1, M2), J1, theta2, J2)
        wide: Any = a
        # The first step is some 1e-12 long and leaves its square, the second nothing.
        for _ in range(2):
            rates = eq1(here, self.p, wide)
            time = (self.J1_0 - here[1]) / rates[1]
            middle = tuple(x + time / 2 * rate for x, rate in zip(here, rates, strict=True))
            rates = eq1(middle, self.p, wide)
            here = tuple(x + time * rate for x, rate in zip(here, rates, strict=True))
        return here[2]


class Sharp(NamedTuple):
    """Phases to 30 digits, (N,) each: radians in [0, 2 pi), where J1 is J1_0.

    With aligned components (6, N) at the starts of `Launch`, the corrections of the map by
    integration, what the phases err by at most, radians: the last correction, or what roundings
    do; and t' from the first crossings to the last.
    """

    theta2_0: list[Fraction]
    starts: Numbers
    moved: Array
    error: Array
    flight: Array


def sharp(launch: Launch, orbits: DoublyAsymptotic, jobs: int = 1) -> Sharp:
    """Refine the phases of doubly asymptotic orbits that the map has found in doubles.

    NoOrbit is raised where integration finds an orbit elsewhere than the map.
    """
    begun, error = launch.anchors(orbits.b), max(FIRST_ERROR, launch.level.displaced(53))
    slope = orbits.I_slope * begun.b_slope
    theta2 = exactly([begun.theta2])
    I_before = step = np.zeros_like(slope)
    for rounds in range(ROUNDS):
        states = launch.states(begun, theta2)
        distance = np.sqrt(np.abs(orbits.I_slope) * max(error, NEAREST)).clip(max=FARTHEST)
        I = _invariant(launch, orbits, states, distance, jobs)
        # The map's slopes err, the more the less the surfaces are split: secants tell them, but not
        # of steps so small that I does not tell them.
        told = np.abs(step) > max(GAINED * np.abs(step).max(initial=0.0), FINEST)
        slope[told] = (I - I_before)[told] / step[told]
        wanted = -I / slope
        last = float(np.abs(wanted).max(initial=0.0))
        if last > 10 * error and not rounds:
            raise NoOrbit(f"integration finds an orbit {last:.2g} rad from where the map has it")
        if last > 10 * error:
            # The correction before gained less: so near to its end an orbit does not tell how much.
            error = last
            continue
        I_before, step = I, wanted
        theta2 = theta2 + exactly([step])
        if last < FINEST:
            break
        error = max(last * GAINED, FINEST)
    else:
        raise NoOrbit(f"theta2_0 does not settle below {last:.2g} rad")
    moved = (theta2 - exactly([begun.theta2])).astype(float)
    states = launch.states(begun, theta2)
    theta2_0 = launch.at_J1_0(begun.theta2 + moved, states, jobs)
    left = max(launch.level.displaced(launch.bits), math.ldexp(NEAREST, -51))
    flight = launch.flight(states, _begun(launch, orbits), orbits.flight, jobs)
    return Sharp(theta2_0, states, moved, np.abs(step).clip(left), flight)


def _begun(launch: Launch, orbits: DoublyAsymptotic) -> Array:
    """t' from the starts to the first crossings, by the map."""
    return orbits.begun - launch.clock(orbits.b, float(launch.J1))


def _invariant(
    launch: Launch, orbits: DoublyAsymptotic, states: Numbers, distance: Array, jobs: int
) -> Array:
    """I of the last passages, measured where the orbits are so close to the periodic orbit."""
    level, upper = launch.level, len(orbits.symbols) % 2 == 0
    times = _begun(launch, orbits) + orbits.flight + orbits.faded(distance)
    at = launch.carried(states, times, jobs).astype(float)
    if not upper:
        at[[2, 5]] *= -1
    made = level.map_level
    psi = rotation_phase(at, launch.doubles, made.a)
    if not (np.hypot(at[0], at[1]) < math.sqrt(FARTHEST)).all():
        raise NoOrbit("an orbit leaves the periodic orbit before its end")
    beside = made.inverted(psi, at[0], at[1])
    return np.asarray(beside.u * beside.v)
