"""Orbits found from random codes and addresses of random bodies, read back by integration."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from rigidpend.experiments.stress.claims import Claim, Findings, Trial
from rigidpend.experiments.stress.scenes import BITS
from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.symbolic import Address, FoundOrbit, NoOrbit, address_of, find_orbit

DELAY = 1e-9
"""Allowed difference of a crossing's time, t'.

A map may err by 2^13 roundings, 1e-12, of a passage's time, which is 100 t' at most; ten add up."""
LONGER = 2, 6
"""Half rotations by which passages of a random address are longer than the shortest, one beyond.

Such an address has half of the symbols, for each half rotation takes half a digit of theta2_0."""
DIGITS = 26
"""Digits of theta2_0: they are found in 106 bits, fewer than those that read the address."""
LOST = "random words, and their longer addresses, for which no orbit was found"
OCCURS = "every finite sequence of turns occurs, and with long passages at every address"
OTHER = f"found orbits whose address by integration in {BITS} bits is another"
OUTLAST = "26 digits outlast ten of the shortest passages, which take two each at most"
LATE = "largest difference of a crossing's time by integration and by the map"
ADD_UP = "2^13 roundings of a passage's time, which is 100 t' at most, for each of ten passages"


def drawn(seed: int, n_symbols: int) -> RouteProblem:
    """A problem with three distinct moments, the centre of gravity and the weight by lot."""
    random = np.random.default_rng(seed)
    # Far from two equal moments, where passages take hundreds of rotations; A2 = 1.
    A1 = random.uniform(1.6, 2)
    A3 = 1 + (A1 - 1) * random.uniform(0.35, 0.75)
    angle, h0 = random.uniform(0.2, 1.3), random.uniform(0.8, 1.6)
    mu = h0 * 10 ** random.uniform(-3.5, -2.5)
    r = f"{np.cos(angle):.3f}", f"{np.sin(angle):.3f}", "0"
    body = Body((f"{A1:.3f}", "1", f"{A3:.3f}"), r, f"{mu:.3g}")
    return RouteProblem(body, exact(f"{h0:.4f}"), exact("1e-8"), n_symbols)


def trials(asked: Any, jobs: int) -> Iterator[Trial]:
    """The body of the config, and random ones."""
    bodies, words, n = asked.addresses.bodies, asked.addresses.words, asked.addresses.n_symbols
    own = RouteProblem(asked.body, asked.h0, asked.J1_0, n)
    yield trial("own body", own, words, asked.seed)
    for k in range(bodies):
        problem = drawn(1000 * asked.seed + k, n)
        yield trial(f"body {k + 1}", problem, words, asked.seed + k + 1)


def trial(name: str, problem: RouteProblem, words: int, seed: int) -> Trial:
    """Random words of a problem's body, of its number of symbols, found and read back."""
    body, n = problem.body, problem.n_symbols
    start: Any = {"h0": problem.h0, "J1_0": problem.J1_0}

    def measure() -> Findings:
        random, lost, other, delay = np.random.default_rng(seed), 0, 0, 0.0
        for _ in range(words):
            asked = Address(None, tuple(int(s) for s in random.integers(0, 2, n)), None)
            for _ in ("shortest", "longer"):
                try:
                    found = find_orbit(body, asked, **start, digits=DIGITS)
                except NoOrbit:
                    lost += 1
                    break
                other += not _read_back(body, start, found)
                delay = max(delay, found.delay)
                asked = _longer(found.address, (n + 1) // 2, random)
        said = f"{words} codes of {n} symbols, and as many longer addresses of half of them"
        return Findings([lost, other, delay], [said])

    claims = (
        Claim(f"{name}: none found", 0, LOST, OCCURS),
        Claim(f"{name}: read back", 0, OTHER, OUTLAST),
        Claim(f"{name}: delay", DELAY, LATE, ADD_UP, "t'"),
    )
    return Trial("addresses", f"addresses {name}", claims, measure)


def _longer(address: Address, n: int, random: np.random.Generator) -> Address:
    """The first n symbols of an address, with more half rotations by lot."""
    turns = np.add(address.half_turns or (), random.integers(*LONGER, len(address.symbols)))
    return Address(address.first, address.symbols[:n], tuple(int(k) for k in turns[:n]))


def _read_back(body: Body, start: dict[str, Any], found: FoundOrbit) -> bool:
    """True if more bits than those that found an orbit tell all of its address."""
    n = len(found.address.symbols)
    own = address_of(body, found.theta2_0, **start, n_symbols=n, precisions=(BITS,))
    return own == found.address and found.confirmed == n
