"""Trials of statements on orbits: no wrong symbol is certain, found orbits have their code.

Computations are spoilt to produce wrong symbols: by coarse tolerances, and by smooth functions of a
given size added to the tables of return maps, of one of three or of all. The integrated sample,
which would reject such maps at once, is left out, so that only the flags are tested.

The truth comes from principal axes; orbits on which these differ from the default run are repeated
in more bits, at last 113. So the default run is judged like all others, and a wrong symbol is
missed only if both formulations err alike. Some orbits go to 113 bits in any case.

Orbits found from random codes and addresses of random bodies are read back by integration.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments import principal_axes
from rigidpend.experiments.stress import scenes
from rigidpend.experiments.stress.scenes import TRUTH_BITS, Claim, Findings, Trial, random_phases
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.free_body import symbols
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.return_map import ReturnMap
from rigidpend.orbits.return_map.build import FIRST, Design
from rigidpend.routes import choice, mapped
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.run import Run
from rigidpend.routes.symbolic import Address, FoundOrbit, NoOrbit, address_of, find_orbit

Codes = NDArray[np.uint8]

STARTS = ("1e-6", "1e-8", "1e-10")
"""Values of J1_0, each for a third of the orbits."""
N_SYMBOLS = 15
"""Symbols on each orbit."""
SPOILT_RIGHT = 0.999
"""Share of right symbols at the coarsest tolerance above which the trial tests nothing.

For 1,500 other orbits at 1e-6 it was 0.993 to 0.995."""
LIES, NO_LIE = "wrong symbols called certain", "no wrong symbol is called certain"
TESTED = "where nothing goes wrong, or is in doubt, flags are not put to the test"
HARD = RouteProblem(Body((2, 1, "3/2"), (1, 1, 0), "1/1000"), exact("1.3342"), exact(1e-8), 32)
"""The problem of the hard orbit: the body of Fig. 4, and twice as many symbols."""
HARD_PHASE = 3.453198983306014
"""Phase of an orbit whose error is twenty times the difference of two computations in 64 bits."""
HARD_CLAIM = Claim(
    "lies on a hard orbit", 0, f"{LIES}, of 32", f"{NO_LIE}, whatever precision decides"
)
SPOILT_MAPS = [(which, size) for which in ("one", "all") for size in ("1e-15", "1e-12", "1e-9")]
"""The spoilt maps, the first or all of them, and the relative size of the change."""
MAPS_CERTAIN = 0.5
"""Share of certain symbols at the largest size above which the trial tests nothing.

Three maps changed by 1e-12 left a tenth of the symbols of 300 other orbits certain."""
CLIMBING = 100
"""One orbit in this many also climbs to 64 bits, and to 106 if integration takes part.

Each takes hundreds of times as long as in doubles, and spoilt maps leave most symbols open."""
MAPS_CLAIMS = (
    *(Claim(f"lies, {which} off by {size}", 0, LIES, NO_LIE) for which, size in SPOILT_MAPS),
    Claim(
        "certain, all off", MAPS_CERTAIN,
        "share of certain symbols where all maps are off by most", TESTED,
    ),
)  # fmt: skip

DELAY = 1e-9
"""Allowed difference of a crossing's time, t'.

A map may err by 2^13 roundings, 1e-12, of a passage's time, which is 100 t' at most; ten add up."""
LONGER = 2, 6
"""Range (end excluded) of half rotations added to the shortest passages for a random address.

Such an address has half of the symbols, because each half rotation costs half a digit of
theta2_0."""
DIGITS = 26
"""Digits of theta2_0, found in 106 bits: fewer bits than those that read the address back."""


def trials(asked: Any, jobs: int) -> Iterator[Trial]:
    """Trials of a hard orbit, spoilt tolerances for each J1_0, spoilt maps, and random codes."""
    sizes, n = asked.honesty, len(STARTS)
    yield hard_trial()
    for k, J1_0 in enumerate(STARTS):
        # The remainder of the division goes to the first starts, so that no orbit is lost.
        orbits, checked = (x // n + (k < x % n) for x in (sizes.orbits, sizes.checked))
        yield trial(asked, J1_0, orbits, checked, jobs)
    problem = RouteProblem(asked.body, asked.h0, asked.J1_0, N_SYMBOLS)
    yield maps_trial(problem, jobs, sizes.orbits // n, asked.seed)
    words, n_symbols = asked.addresses.words, asked.addresses.n_symbols
    own = RouteProblem(asked.body, asked.h0, asked.J1_0, n_symbols)
    yield address_trial("own body", own, words, asked.seed)
    for k in range(asked.addresses.bodies):
        problem = drawn(1000 * asked.seed + k, n_symbols)
        yield address_trial(f"body {k + 1}", problem, words, asked.seed + k + 1)


def trial(asked: Any, J1_0: str, orbits: int, checked: int, jobs: int) -> Trial:
    """Trial of doubles alone at spoilt tolerances, and of the default run, against the truth.

    The first `checked` orbits are followed in 113 bits in any case.
    """
    tolerances, at = [str(x) for x in asked.honesty.tolerances], f"J1_0 = {J1_0}"
    names = [*(f"lies at {x}, {at}" for x in tolerances), f"lies by default, {at}"]
    claims = (
        *(Claim(name, 0, LIES, NO_LIE) for name in names),
        Claim(
            f"against 113 bits, {at}", 0,
            "symbols of the default run that differ from principal axes in 113 bits",
            "the default precisions decide every symbol of these orbits, and rightly",
        ),
        Claim(
            f"uncertain, {at}", 0,
            "share of symbols that the default precisions leave uncertain",
            "113 bits outlast 15 passages, each of which triples an error",
        ),
        Claim(
            f"right at the coarsest, {at}", SPOILT_RIGHT,
            "share of symbols that are right at the coarsest tolerance", TESTED,
        ),
    )  # fmt: skip

    def measure() -> Findings:
        # Different phases for each J1_0, but the same in every run.
        phases = random_phases(orbits, (asked.seed, *J1_0.encode()))
        problem = RouteProblem(asked.body, asked.h0, exact(J1_0), N_SYMBOLS)
        default = scenes.routes(problem, phases, resolve(), jobs)
        true = true_codes(problem, phases, default.codes, checked, jobs)
        # A tolerance spoils only integrations; the maps' tables have a trial of their own.
        coarse = [resolve("taylor", x, (53,)) for x in tolerances]
        alone = [scenes.routes(problem, phases, x, jobs, "integration") for x in coarse]
        told = [principal_axes.judged(x, true) for x in (*alone, default)]
        coarsest = np.argmax(np.array(tolerances, dtype=float))
        values = [
            *(x["wrong_trusted"] for x in told),
            (default.codes[:, :checked] != true[:, :checked]).sum(),
            1 - default.certain.mean(),
            1 - told[coarsest]["wrong_symbols"] / true.size,
        ]
        return values, {}

    return Trial("honesty", at, claims, measure)


def true_codes(
    problem: RouteProblem, phases: Any, doubted: Codes, checked: int, jobs: int
) -> Codes:
    """The symbols of orbits from an independent formulation.

    Doubles suffice for orbits on which nothing differs from `doubted`, the symbols of a run; the
    first `checked` orbits are followed in 113 bits in any case. Without heyoka only those are
    known, from integers of 113 bits, and the others are left out.
    """
    first = phases[:checked]
    if not principal_axes.installed():
        return symbols(scenes.route_crossings(problem, first, jobs, TRUTH_BITS, "scipy").separatrix)
    true, _ = principal_axes.settled(
        problem, phases, doubted, jobs, (53, *principal_axes.TRUTH_BITS)
    )
    if checked and principal_axes.working_type(TRUTH_BITS):
        true[:, :checked] = principal_axes.codes(problem, first, bits=TRUTH_BITS, jobs=jobs)
    return true


def hard_trial() -> Trial:
    """Trial of the default precisions on an orbit whose error two computations once hid."""

    def measure() -> Findings:
        phases = np.array([HARD_PHASE])
        found = scenes.routes(HARD, phases, resolve())
        true = true_codes(HARD, phases, found.codes, 1, 1)
        return [principal_axes.judged(found, true)["wrong_trusted"]], {}

    return Trial("honesty", "hard orbit", (HARD_CLAIM,), measure)


def spoilt(made: ReturnMap, size: float, seed: int) -> ReturnMap:
    """A copy of the map with a smooth function of a relative size added to every table."""
    random = np.random.default_rng(seed)

    def other(values: Any) -> Any:
        # Adding 0.0 copies an array of doubles as well as one of pairs.
        values = values + 0.0
        # Only the lowest coefficients: a smooth error, as of a wrong series, and not noise.
        values[0, :3] += size * random.normal(size=values[0, :3].shape) * np.abs(values).max()
        return values

    charts: Any = (
        type(chart)(*(table._replace(values=other(table.values)) for table in chart))
        for chart in made.charts
    )
    return replace(made, charts=tuple(charts))


def spoilt_maps(run: Run, size: float, every: bool) -> mapped.Maps:
    """The maps of a run, the first or all of them spoilt."""

    class Spoilt(mapped.Maps):
        def map_of(self, bits: int, design: Design) -> ReturnMap:
            right = super().map_of(bits, design)
            if design.unit != FIRST.unit and not every:
                return right
            return spoilt(right, size, int(1000 * float(design.unit)))

    return Spoilt(run)


def maps_trial(problem: RouteProblem, jobs: int, orbits: int, seed: int) -> Trial:
    """Trial of codes by spoilt maps in doubles, for some orbits also in more bits."""

    def measure() -> Findings:
        phases = random_phases(orbits, (seed, orbits))
        true = scenes.routes(problem, phases, resolve(), jobs).codes
        if principal_axes.installed():
            true = true_codes(problem, phases, true, 0, jobs)
        flags = [
            _flagged(problem, phases, true, float(size), which == "all", jobs)
            for which, size in SPOILT_MAPS
        ]
        lies = [float((wrong & certain).sum()) for wrong, certain in flags]
        return [*lies, flags[-1][1].mean()], {}

    return Trial("honesty", "spoilt maps", MAPS_CLAIMS, measure)


def _flagged(
    problem: RouteProblem, phases: Any, true: Codes, size: float, every: bool, jobs: int
) -> tuple[Any, Any]:
    """Flags of wrong symbols and of certain ones, (n_symbols, orbits and some of them again)."""
    some, wrong, certain = slice(None, None, CLIMBING), [], []
    for precisions, chosen in (((53,), slice(None)), ((53, 64), some), ((53, 64, 106), some)):
        arithmetic = resolve("taylor", None, precisions)
        run = Run(problem, Phases(phases[chosen]), arithmetic, jobs)
        # Without the integrated sample, which would reject such maps.
        found = choice.by_maps(spoilt_maps(run, size, every), sampled=False)
        wrong.append(symbols(found.crossings.separatrix) != true[:, chosen])
        certain.append(found.certain)
    return np.hstack(wrong), np.hstack(certain)


def drawn(seed: int, n_symbols: int) -> RouteProblem:
    """A problem with random distinct moments, centre of gravity and weight."""
    random = np.random.default_rng(seed)
    # Moments are kept apart, since near equal ones passages take hundreds of rotations; A2 = 1.
    A1 = random.uniform(1.6, 2)
    A3 = 1 + (A1 - 1) * random.uniform(0.35, 0.75)
    angle, h0 = random.uniform(0.2, 1.3), random.uniform(0.8, 1.6)
    mu = h0 * 10 ** random.uniform(-3.5, -2.5)
    r = f"{np.cos(angle):.3f}", f"{np.sin(angle):.3f}", "0"
    body = Body((f"{A1:.3f}", "1", f"{A3:.3f}"), r, f"{mu:.3g}")
    return RouteProblem(body, exact(f"{h0:.4f}"), exact("1e-8"), n_symbols)


def address_trial(name: str, problem: RouteProblem, words: int, seed: int) -> Trial:
    """Trial of orbits found from random words of a problem's length, and read back."""
    n = problem.n_symbols

    def measure() -> Findings:
        random, lost, other, delay = np.random.default_rng(seed), 0, 0, 0.0
        for _ in range(words):
            asked = Address(None, tuple(int(s) for s in random.integers(0, 2, n)), None)
            for _ in ("shortest", "longer"):
                start: Any = {"h0": problem.h0, "J1_0": problem.J1_0}
                try:
                    found = find_orbit(problem.body, asked, **start, digits=DIGITS)
                except NoOrbit:
                    lost += 1
                    break
                other += not _read_back(problem, found)
                delay = max(delay, found.delay)
                asked = _longer(found.address, (n + 1) // 2, random)
        return [lost, other, delay], {}

    claims = (
        Claim(
            f"{name}: none found", 0,
            "random words, and their longer addresses, for which no orbit was found",
            "every finite sequence of turns occurs, and with long passages at every address",
        ),
        Claim(
            f"{name}: read back", 0,
            f"found orbits whose address by integration in {TRUTH_BITS} bits is another",
            "26 digits outlast ten of the shortest passages, which take two each at most",
        ),
        Claim(
            f"{name}: delay", DELAY,
            "largest difference of a crossing's time by integration and by the map",
            "2^13 roundings of a passage's time, which is 100 t' at most, for each of ten passages",
            "t'",
        ),
    )  # fmt: skip
    return Trial("addresses", f"addresses {name}", claims, measure)


def _longer(address: Address, n: int, random: np.random.Generator) -> Address:
    """The first n symbols of an address, with random further half rotations."""
    turns = np.add(address.half_turns or (), random.integers(*LONGER, len(address.symbols)))
    return Address(address.first, address.symbols[:n], tuple(int(k) for k in turns[:n]))


def _read_back(problem: RouteProblem, found: FoundOrbit) -> bool:
    """True if integration in more bits than found the orbit gives its whole address."""
    n = len(found.address.symbols)
    start: Any = {"h0": problem.h0, "J1_0": problem.J1_0}
    own = address_of(problem.body, found.theta2_0, **start, n_symbols=n, precisions=(TRUTH_BITS,))
    return own == found.address and found.confirmed == n
