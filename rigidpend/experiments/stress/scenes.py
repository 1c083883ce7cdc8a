"""Claims that a run may refute, and scenes that trials share: orbits, starts, distances.

A claim has its bound, and its known limit, before the run. The truth for doubles is computed in
113 bits; for more bits it comes from integers.
"""

import math
import re
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rigidpend.experiments.data import Data, Tree
from rigidpend.experiments.stress import LIMIT, PASSED, REFUTED
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.equations import AlignedCoefficients, rounded_coefficients
from rigidpend.mechanics.free_body import exponent, fastest_rate, theta1
from rigidpend.numbers import Array
from rigidpend.numbers.checked import ParameterError
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import Crossings, Orbits
from rigidpend.orbits.integrate.arithmetic import DEFAULT_TOLERANCE, resolve
from rigidpend.routes.certainty import FIRST_SCALES
from rigidpend.routes.codes import codes_of
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.run import Run

TRUTH_BITS = 113
"""Precision of the truth for orbits decided in fewer bits."""
INTEGER_BITS = 192
"""Precision, in integers, of the truth for orbits decided in `TRUTH_BITS` or more.

It is above the last of the default precisions, so that no computation judges itself."""
SIGMAS = 4.0
"""Standard errors within which two means, or two medians, count as equal."""


class Claim(NamedTuple):
    """A sentence about the program that one number can refute, with fields of `OF_CLAIM`."""

    name: str
    bound: float
    measured: str
    reason: str
    unit: str = "1"
    limit: str = ""
    up_to: float = -math.inf

    def told(self, value: float, note: str) -> Tree:
        """The claim with the measured value, as it is stored; NaN, no measurement, fails."""
        ratio = value / self.bound if self.bound else math.inf if value else 0.0
        return {
            **self._asdict(),
            "bound": float(self.bound),
            "up_to": float(max(self.bound, self.up_to)),
            "verdict": PASSED if value <= self.bound else LIMIT if value <= self.up_to else REFUTED,
            "note": note,
            "value": value,
            "ratio": float(ratio),
        }


Findings: TypeAlias = tuple[Sequence[float], Data]
"""A number for each claim of a trial, in order, and the curves behind them, as in `CURVES`."""


class Trial(NamedTuple):
    """Claims, and the measurement that tests them all."""

    kind: str
    name: str
    claims: Sequence[Claim]
    measure: Callable[[], Findings]

    @property
    def label(self) -> str:
        """Name in result files and on disk, without blanks, slashes and brackets."""
        return re.sub(r"[^A-Za-z0-9.-]+", "_", self.name).strip("_")

    def tried(self) -> Tree:
        """Measure, and store the claims; a refusal to compute refutes all of them."""
        note = ""
        try:
            values, curve = self.measure()
        except (ParameterError, ArithmeticError) as refused:
            values, curve, note = [math.nan] * len(self.claims), {}, f"refused: {refused}"
        rows = zip(self.claims, values, strict=True)
        claims = {claim.name: claim.told(float(value), note) for claim, value in rows}
        return {"claims": claims, "curves": {self.label: curve} if curve else {}}


class Place(NamedTuple):
    """Place where orbits start, with a bound of its own instead of a route problem."""

    name: str
    separatrix: int
    J1: float
    J2mJ1: float
    aside: float = 0.0
    """Distance from the separatrix in theta1, radians."""
    J3: float = 0.0

    def state(self, body: Body, theta2: float) -> Array:
        """The aligned components (6,) of a start; on a separatrix its own Q is exactly 0."""
        p = body.angles()
        J2 = self.J1 + self.J2mJ1
        cosq = math.sqrt((J2 - self.J3) * (J2 + self.J3)) / J2
        at = float(theta1(self.separatrix, p, np)) + self.aside
        c = Canonical(self.J1, self.J2mJ1, self.J3, at, theta2, 0.0, cosq)
        made = aligned_from_canonical(c, p.alpha0, p.beta0)
        # The sine of a rounded theta1 is not exactly 0, as Q must be on the separatrix.
        if not self.aside:
            made = made._replace(**{"Qm" if self.separatrix in (2, 4) else "Qp": 0.0})
        return np.array(made)


class Scene(NamedTuple):
    """A body and \\|M\\|, dimensionless, of orbits near separatrices."""

    body: Body
    J2: float
    jobs: int = 1
    """Number of computations at a time."""
    seed: int = 1
    """Seed of random phases."""

    @property
    def c(self) -> AlignedCoefficients:
        """Coefficients of the body for an engine in doubles."""
        return rounded_coefficients(self.body.angles(113))

    @property
    def u(self) -> float:
        """Exponent of the separatrices, per t'."""
        return exponent(self.J2, self.body.angles(), math)

    @property
    def rate(self) -> float:
        """Largest rate of the phase, radians per t'."""
        return fastest_rate(self.J2, self.body.angles(), math)

    @property
    def h0(self) -> float:
        """Energy without weight, kappa J2^2/2."""
        return self.body.kappa * self.J2**2 / 2

    @property
    def rotation(self) -> float:
        """Time t' of a rotation without weight."""
        return 2 * math.pi / (self.body.kappa * self.J2)

    def starts(self, n: int, J1: float, J3: float = 0.0) -> Array:
        """Aligned components, (6, n), of starts on separatrix 2 with random phases."""
        place = Place("", 2, J1, self.J2 - J1, 0.0, J3)
        phases = random_phases(n, self.seed)
        return np.stack([place.state(self.body, x) for x in phases], axis=1)


def of_problem(asked: Any, jobs: int) -> Scene:
    """The scene of the body and the energy that a config asks for."""
    J2 = math.sqrt(2 * float(asked.h0) / asked.body.kappa)
    return Scene(asked.body, J2, jobs, asked.seed)


def random_phases(n: int, seed: Any) -> Array:
    """Phases theta2_0 of n orbits, radians, the same in every run."""
    return np.random.default_rng(seed).uniform(0, 2 * np.pi, n)


def followed(scene: Scene, orbits: Orbits, bits: int = 53) -> Crossings:
    """The crossings of orbits at the default tolerance, in `bits` bits from the same doubles."""
    if bits > 53:
        coefficients = AlignedCoefficients(*map(Fraction, orbits.coefficients))
        states = np.vectorize(Fraction, otypes=[object])(orbits.states)
        orbits = orbits._replace(coefficients=coefficients, states=states)
    tolerance = DEFAULT_TOLERANCE["taylor"]
    return integrate.crossings(
        orbits, engine="taylor", bits=bits, tolerance=tolerance, jobs=scene.jobs
    )


routes = partial(codes_of, use_kept=True)
"""Route codes as `rigidpend.route_codes` gives them."""


def route_crossings(
    problem: RouteProblem, phases: Sequence[Any], jobs: int, bits: int, engine: str
) -> Crossings:
    """The crossings of a route problem in one precision of 64 bits or more, in t'.

    The engine `scipy` computes in integers, which share no arithmetic with the other engine.
    """
    run = Run(problem, Phases(phases), resolve(engine, None, (bits,)), jobs)
    return run.crossings(bits, FIRST_SCALES, range(len(run.phases)))


def phase_errors(found: Crossings, true: Crossings, rate: float) -> Array:
    """Distances of crossings from the true ones, (n_crossings, n), in radians.

    Times of both are in one unit, in which `rate` is in radians. The distance is infinite where
    the separatrices differ, or where only one of both crosses.
    """
    apart = rate * np.abs(found.time - true.time)
    absent = (found.separatrix == 0) & (true.separatrix == 0)
    return np.where(absent, 0.0, np.where(found.separatrix == true.separatrix, apart, np.inf))
