"""Experiment `closed_orbits`: the periodic orbits of all words, and averages over all of them."""

import math
from itertools import zip_longest

import numpy as np

from rigidpend.config.description import Row
from rigidpend.experiments.closed_orbits.schema import Config, Problem
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Tree
from rigidpend.experiments.shared import attributes
from rigidpend.machine.progress import PartDone
from rigidpend.numbers.texts import NO_SYMBOL
from rigidpend.routes.symbolic.chain import (
    NoOrbit,
    System,
    check_told,
    on_surface,
    passages,
    signs_of,
)
from rigidpend.routes.symbolic.closed import (
    ClosedOrbit,
    actions,
    closed,
    closing,
    lyapunov,
    roundings,
    words,
)
from rigidpend.routes.symbolic.levels import ChainLevel
from rigidpend.routes.symbolic.shortest import chain_through
from rigidpend.routes.symbolic.stretching import stretching

SEED = 1
BEGIN, FOUND, VERIFIED = 0.2, 4e-3, 2.5e-3
"""Seconds of any run, seconds to find the orbit of a word, and for each half rotation to verify it.

Seconds of a word are those of a length n, of which there are 2^n. Measured with five bodies."""
PARTS = 10
"""Parts of the long orbit, whose scatter gives the error of its exponent."""


def compute(config: Config, means: Means) -> Tree:
    """Find and verify the closed orbits of all words."""
    problem = config.problem
    level = ChainLevel.of(problem.body, problem.h)
    found = [_closed(level, word, problem) for word in words(problem.longest)]
    means.report(f"{len(found)} closed orbits, {sum(o.stable for o in found)} of them stable")
    return {
        "orbits": _orbits(problem, found, means),
        "averages": _averages(problem, level, found),
        "places": _places(found),
    }


def _closed(level: ChainLevel, word: tuple[int, ...], problem: Problem) -> ClosedOrbit:
    """The orbit of a word; NoOrbit says which one is not found, or cannot be verified."""
    try:
        orbit = closed(level, word, problem.half_turns)
    except (NoOrbit, OverflowError) as error:
        said = f"no orbit of {''.join(map(str, word))} with half_turns = {problem.half_turns}"
        raise NoOrbit(f"{said}: {error}") from None
    # Said before any longer word is sought, and before any integration.
    check_told(orbit.chain)
    if len(word) <= problem.verified:
        roundings(orbit)
    return orbit


def cost(config: Config) -> float:
    """Estimate of the seconds that a config takes; the number of words doubles with each symbol."""
    problem = config.problem
    verified = problem.half_turns * 2.0 ** min(problem.verified, problem.longest)
    return BEGIN + FOUND * 2.0**problem.longest + VERIFIED * verified


def _orbits(problem: Problem, found: list[ClosedOrbit], means: Means) -> Tree:
    # Orbits that are not verified keep NaN.
    gaps = np.full((2, len(found)), np.nan)
    verified = [orbit for orbit in found if len(orbit.word) <= problem.verified]
    for k, orbit in enumerate(verified):
        one = closing(orbit)
        gaps[:, k] = one.error, one.expected
        text = f"{k + 1} of {len(verified)} orbits verified"
        means.report(PartDone(text, k + 1, len(verified)))
    alone = [passages(orbit.chain) for orbit in found]
    for orbit, (right, _) in zip(found, alone, strict=True):
        if not right.all():
            raise ArithmeticError(f"integration leaves the orbit of {orbit.code}")
    return {
        # Row by row the symbols of a word, (n, longest).
        "word": np.array([*zip_longest(*(o.word for o in found), fillvalue=NO_SYMBOL)], "u1").T,
        **attributes(("period", "mirrored", "exponent", "exponent_error", "stable"), found),
        "action": actions([orbit.chain for orbit in found]),
        "positive": np.array([orbit.trace > 0 for orbit in found]),
        "residual": np.array([orbit.chain.residual for orbit in found]),
        "alone": np.array([error.max() for _, error in alone]),
        "closing": gaps[0],
        "closing_expected": gaps[1],
    }


def _averages(problem: Problem, level: ChainLevel, found: list[ClosedOrbit]) -> Tree:
    lengths = np.arange(1, problem.longest + 1)
    mean, error = _long_orbit(level, problem.symbols, problem.half_turns)
    return {
        "length": lengths,
        "points": 2**lengths,
        "mean": np.array([lyapunov(found, int(n)) for n in lengths]),
        "long_orbit": mean,
        "long_orbit_error": error,
    }


def _long_orbit(level: ChainLevel, n: int, half_turns: int) -> tuple[float, float]:
    """The Lyapunov exponent per passage of an orbit with random symbols, and its error."""
    symbols = np.random.default_rng(SEED).integers(0, 2, n)
    system = System(level, on_surface, signs_of(symbols))
    # chi of the first crossing is close to this plus its angle on the unstable surface; it depends
    # on the units of the energy.
    origin = float(level.arriving(0.0, 0.0).chi[0])
    grown = stretching(chain_through(system, half_turns * np.arange(n + 1), -origin))
    # Growths far apart along the orbit are nearly independent, and so are the means of the parts.
    parts = [float(part.mean()) for part in np.array_split(grown, PARTS)]
    return float(grown.mean()), float(np.std(parts, ddof=1) / math.sqrt(PARTS))


def _places(found: list[ClosedOrbit]) -> Tree:
    """The upward crossings of all orbits."""
    # Every second crossing is upward; the last one repeats the first.
    chi = [orbit.chain.chi[:-1:2] for orbit in found]
    return {
        "chi": np.mod(np.concatenate(chi) + np.pi, 2 * np.pi) - np.pi,
        "d": np.concatenate([orbit.chain.d[:-1:2] for orbit in found]),
        "of": np.repeat(np.arange(len(found)), [len(each) for each in chi]),
    }


def describe(config: Config) -> list[Row]:
    """Row with the number of words that a config asks for."""
    longest = config.problem.longest
    count = sum(1 for _ in words(longest))
    return [Row("words", str(count), f"of up to {longest} symbols, one for each closed orbit")]
