"""Experiment `asymptotic_orbits`: homoclinic and heteroclinic orbits with short codes."""

import math
from fractions import Fraction
from functools import partial

import numpy as np

from rigidpend.experiments.asymptotic_orbits import PLANE
from rigidpend.experiments.asymptotic_orbits.schema import Config, Problem
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Tree
from rigidpend.machine.progress import PartDone
from rigidpend.machine.wording import counted
from rigidpend.mechanics import in_space
from rigidpend.numbers import Array
from rigidpend.orbits import columns
from rigidpend.orbits.integrate.arithmetic import PAIRS
from rigidpend.orbits.integrate.kernel.lane_numbers import exactly
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map import MapError
from rigidpend.orbits.return_map.looks import Rough, first_look, whole_reach
from rigidpend.orbits.return_map.reduced import coefficients
from rigidpend.routes.codes import codes_of
from rigidpend.routes.herpolhode import samples
from rigidpend.routes.problem import passage_rotations, rotation_period
from rigidpend.routes.symbolic.asymptotic import (
    DoublyAsymptotic,
    doubly_asymptotic,
    least_half_turns,
    skeleton,
)
from rigidpend.routes.symbolic.chain import NoOrbit
from rigidpend.routes.symbolic.levels import ChainLevel, displacement
from rigidpend.routes.symbolic.sharp import Launch, integration_bits, sharp
from rigidpend.surfaces.melnikov import amplitude

SECONDS, ROTATION = 0.05, {PAIRS: 2.2e-4, 2 * PAIRS: 1.4e-3}
"""Seconds of each length of codes, and of a rotation of an orbit, by the bits of its integration.

Measured on one core with twelve bodies; those of a rotation are also for finding the orbit."""
ENDS = 5.0
"""Rotations of an orbit before its first crossing and behind its last one, together, over nu."""
CHOICES, SPARE = 1.4, 0.4
"""Growth of the number of orbits with each symbol, over one more than the half rotations to spare.

These are what passages may take beyond typical ones, at least the second number. With the same
bodies the estimate is then within a factor of 2.6."""
PART = {PAIRS: 1024, 2 * PAIRS: 256}
"""Orbits in a part of the work, by the bits of their integration: it takes a minute or two."""
SAMPLES = 64
"""Samples of a drawn orbit per rotation of the pendulum."""
FADED = 7e-4
"""Distance from its last periodic orbit at which a drawn orbit ends, over J2_0."""


def compute(config: Config, means: Means) -> Tree:
    """Find the orbits by the body's return map, their phases to 30 digits, and sample a few."""
    problem = config.problem
    level = ChainLevel.of(problem.body, problem.h)
    launch = Launch(level, problem.J1_0)
    expected, lengths = _expected(problem), dict[str, Tree]()
    drawn: dict[str, Tree] = {}
    for n, (rough, arcs) in enumerate(skeleton(level, problem.symbols, problem.half_turns)):
        if not rough.b.size:
            said = f"passages of at most half_turns = {problem.half_turns} half rotations"
            least = least_half_turns(level, problem.symbols, problem.half_turns)
            # No number is found in the Hess case, where more of them do not help.
            mend = f"allow {least}, or fewer symbols" if least else "allow fewer symbols"
            raise NoOrbit(f"no orbit with {counted(n, 'symbol')} has only {said}: {mend}")
        name, orbits = str(n), _ordered(launch, doubly_asymptotic(level, rough))
        means.report(f"{counted(n, 'symbol')}: {counted(len(orbits.b), 'orbit')}")
        lengths[name] = {
            **_in_parts(launch, orbits, expected, means),
            "arcs": arcs,
            "ends": "homoclinic" if n % 2 else "heteroclinic",
        }
        if n < problem.drawn and len(orbits.b):
            drawn[name] = _sampled(config, launch, orbits, means)
    return {"orbits": lengths, "plane": _plane(problem, means), "drawn": drawn}


def cost(config: Config) -> float:
    """Estimate of the seconds that a config takes on one core, without the body's map."""
    try:
        return float(_expected(config.problem).sum())
    except MapError:
        return SECONDS


def _expected(problem: Problem) -> Array:
    """Estimates of the seconds that codes of 0, 1, ... symbols take on one core."""
    # Longer passages than are asked for are not followed.
    turns = min(2 * passage_rotations(problem.routes), problem.half_turns)
    growth = CHOICES * (1 + max(problem.half_turns - turns, SPARE))
    n = np.arange(problem.symbols + 1)
    followed = 2 * growth**n * (ENDS * problem.body.nu + n * turns / 2)
    return SECONDS + ROTATION[_bits(problem)] * followed


def _bits(problem: Problem) -> int:
    """Bits of the integration, from a first look at the layer and from Melnikov's splitting."""
    p, h = problem.body.angles(), float(problem.h)
    body = Rough(coefficients(p, "1", precision(53)), h)
    widest = max(first_look(body, whole_reach(body)).widths)
    # |I| on the lower orbit's surface to first order: separatrix 2 is that of upward crossings.
    J2 = math.sqrt(2 * h / p.kappa)
    split = 2 * p.kappa * J2 * p.mu * abs(amplitude(2, J2, p))
    return integration_bits(displacement(widest, split, PAIRS))


def _ordered(launch: Launch, orbits: DoublyAsymptotic) -> DoublyAsymptotic:
    """The orbits by their phases in [0, 2 pi)."""
    phase = np.mod(launch.theta2(orbits.b, float(launch.J1_0)), 2 * np.pi)
    return columns(orbits, np.argsort(phase))


def _in_parts(launch: Launch, orbits: DoublyAsymptotic, expected: Array, means: Means) -> Tree:
    """The orbits of one length, in parts that an interrupted run keeps."""
    n, N, size, parts = len(orbits.symbols), len(orbits.b), PART[launch.bits], list[Tree]()
    for first in range(0, max(N, 1), size):
        some = columns(orbits, slice(first, first + size))
        name = f"symbols.{n}.{first:07d}"
        parts.append(means.part(name, partial(_orbits, launch, some, means.jobs)))
        done = min(first + size, N)
        text, seconds = f"{counted(n, 'symbol')}: orbits to {done} of {N}", expected[: n + 1].sum()
        seconds -= expected[n] * (N - done) / max(N, 1)
        means.report(PartDone(text, seconds, expected.sum()))
    return {field: np.concatenate([x[field] for x in parts], axis=-1) for field in parts[0]}


def _orbits(launch: Launch, orbits: DoublyAsymptotic, jobs: int) -> Tree:
    """Some of the orbits of one length, with their phases to 30 digits."""
    fine = sharp(launch, orbits, jobs)
    high = np.array([float(x) for x in fine.theta2_0])
    return {
        "word": orbits.symbols,
        "half_turns": np.diff(orbits.chain.cells, axis=0),
        "first": orbits.chain.cells[0] % 2,
        "theta2_0": high,
        "theta2_0_rest": np.array(
            [float(x - Fraction(y)) for x, y in zip(fine.theta2_0, high, strict=True)]
        ),
        "flight": fine.flight,
        "theta3": orbits.theta3,
        "residual": orbits.chain.residual,
        "moved": fine.moved,
        "error": fine.error,
    }


def _sampled(config: Config, launch: Launch, orbits: DoublyAsymptotic, means: Means) -> Tree:
    """The orbit with the shortest flight, from where J1 = J1_0, in doubles."""
    problem, k = config.problem, int(np.argmin(orbits.flight))
    one = columns(orbits, np.array([k]))
    start, shown = (float(launch.clock(one.b, float(J1))[0]) for J1 in (launch.J1, launch.J1_0))
    anchors = launch.anchors(one.b)
    [state] = launch.states(anchors, exactly([anchors.theta2])).T
    crossed = float(one.begun[0])
    ended = FADED * float(problem.routes.J2_0(53))
    end = crossed + float((one.flight + one.faded(ended))[0])
    t = np.arange(shown, end, rotation_period(problem.routes) / SAMPLES)
    states = states_at(
        in_space.field(problem.body),
        np.array([*map(float, state), 0.0]),
        t - start,
        engine=means.arithmetic.engine,
        tolerance=means.arithmetic.tolerance,
    )
    return {**samples(problem.body, t - crossed, states)._asdict(), "orbit": k}


def _plane(problem: Problem, means: Means) -> Tree:
    """Route codes of Fig. 4's orbits, whose symbols change at the doubly asymptotic orbits."""
    phases = 2 * np.pi * (np.arange(problem.columns) + 0.5) / problem.columns
    found = codes_of(problem.routes, list(phases), means.arithmetic, means.jobs)
    return {name: getattr(found, name) for name in PLANE}
