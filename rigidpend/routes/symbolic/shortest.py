"""Chains with given half rotations, and the fewest that an orbit with given symbols can take."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from functools import partial

import numpy as np

from rigidpend.numbers import Array
from rigidpend.routes.symbolic.chain import Chain, NoOrbit, System, check_split, on_surface
from rigidpend.routes.symbolic.levels import ChainLevel, Signs

APART = 4
"""Half rotations beyond those of |I| = splitting from which no crossing disturbs the next."""
SHORTEST_STEP = 0.02
"""Least step of that length, radians; a chain that ends between two such steps ends in a fold."""
WINDOW = 8
"""Number of passages on each side of a shortened one that are solved with it.

The effect on crossings decreases about tenfold from one passage to the next: with two bodies and
random words it was 1e-9 half rotations at the ends of this window."""
INSIDE = 0.36
"""Distance from the middle of a cell, half rotations, within which free crossings stay.

Nearer to the border, at 0.5, orbits end in folds. Measured on random words: at 0.45 some of 200
symbols could not be put together from their windows, at 0.36 none of 1,000."""
LESSENED = 100
"""Number of symbols up to which half rotations are reduced one by one, 30 ms each."""
MORE_HALF_TURNS = 24
"""Number of half rotations, from the least on, that are tried alike for all passages."""
ENDS = 0.0, 0.2, -0.2, 0.4, -0.4
"""Places of the last crossing in its cell, half rotations from the middle, in the order tried."""
STARTS = 60
"""Number of random guesses after these."""
SLACK = 0.25
"""Share by which crossings off the surface may change I more than those on it."""


def chain_through(
    system: System, cells: Signs, parameter: float, patient: bool = True, end: float = 0.0
) -> Chain:
    """The chain whose crossings lie in given cells, the last one `end` off the middle of its own.

    `end` is in half rotations. If Newton's method does not find the chain from the middles of the
    cells, and `patient` is true, passages are made longer, until no crossing disturbs the next, and
    then shorter by steps (continuation). NoOrbit says which passage is too short.
    """
    angles = np.asarray(np.pi * cells, dtype=float)
    angles[-1] += np.pi * end
    system = system._replace(last_chi=float(angles[-1]))
    x = system.guess(angles, parameter)
    try:
        return system.solved(x).in_cells(cells)
    except NoOrbit:
        if not patient:
            raise
    level = system.level
    apart = level.half_turns(level.splitting) + APART
    longer = max(APART, apart - float(np.diff(cells).min())) * math.pi
    step, made = longer / 4, None
    # `x` solves the chain at the last length that was found; a step that fails is halved.
    while True:
        try:
            made = system._replace(longer=longer).solved(x)
        except NoOrbit:
            if made is None or step < SHORTEST_STEP:
                raise NoOrbit(_reason(level, made, longer)) from None
            step /= 2
            longer += step
            continue
        if longer == 0:
            return made.in_cells(cells)
        x, longer = made.unknowns, max(0.0, longer - step)


def _reason(level: ChainLevel, made: Chain | None, longer: float) -> str:
    """Message about a continuation that ended at a length; `made` is the last chain found."""
    if made is None:
        return "Newton's method does not converge even for long passages"
    growth = made.b - made.a[: len(made.b)]
    k = int(np.argmin(growth))
    return (
        "none was found with so few half rotations. There is one with longer passages; as these"
        f" are shortened, all alike, it meets another orbit and both vanish, in a fold, where"
        f" passages are still {longer / math.pi:.2f} of a half rotation too long. The shortest is"
        f" passage {k + 1}: it would need |I| = {math.exp(-growth[k] * level.exponent):.3g}, and a"
        f" crossing on the surface gives it {level.splitting:.3g} at most"
    )


def with_half_turns(
    system: System,
    first: int,
    parameter: float,
    turns: tuple[int, ...],
    beside: Array | None = None,
) -> Chain:
    """The chain with exactly these half rotations, its last crossing anywhere in its cell.

    `beside` is chi of the crossings of an orbit with this address, radians; if it is given, that
    orbit is taken. NoOrbit says which passage is too short.
    """
    check_possible(system.level, turns, float(system.begin(parameter).I) if system.begin else 0.0)
    cells, reason = np.cumsum([first, *turns]), NoOrbit()
    if beside is not None:
        with contextlib.suppress(NoOrbit):
            one = system._replace(last_chi=float(beside[-1]))
            return one.solved(one.guess(beside, parameter)).in_cells(cells)
    for end in ENDS:
        try:
            return chain_through(system, cells, parameter, end=end)
        except NoOrbit as error:
            reason = reason if str(reason) else error
    # No guess helps where roundings displace the crossings.
    check_split(system.level, system.level.narrowest(system.signs))
    # The seed is fixed, so that a call always finds the same orbit.
    random = np.random.default_rng(len(turns))
    for offsets in random.uniform(-0.45, 0.45, (STARTS, len(cells))):
        angles = np.asarray(np.pi * (cells + offsets), dtype=float)
        one = system._replace(last_chi=float(angles[-1]))
        with contextlib.suppress(NoOrbit):
            return one.solved(one.guess(angles, parameter)).in_cells(cells)
    raise reason


def check_possible(level: ChainLevel, turns: tuple[int, ...], I: float = 0.0) -> None:
    """Raise NoOrbit where so few half rotations need a larger |I| than crossings can give.

    `turns` are half rotations between cells; between the crossings themselves there is at most one
    more. A crossing changes I by the splitting at most, so that |I| is at most that of the passage
    before plus the splitting. `I` is that of the passage before the first.
    """
    most = abs(I)
    for k, n in enumerate(turns):
        most += (1 + SLACK) * level.splitting
        needed = level.invariant(n + 1)
        if needed > most:
            raise NoOrbit(
                f"none exists: passage {k + 1} with {n} half rotations needs |I| ="
                f" {needed:.3g} at least, and crossings give it {most:.3g} at most"
            )
        # The passage has at least n - 1 half rotations between its crossings.
        most = min(most, level.invariant(n - 1))


def shortest(
    system: System, first: int, parameter: float, turns: tuple[int, ...] = (), begin: int = 0
) -> Chain:
    """The chain of a code with few half rotations, the first of which may be given, but not all.

    All free passages begin with the same number, the least that allows an orbit. The numbers are
    then reduced one by one from the first passage on, as far as an orbit exists whose crossings
    stay `INSIDE`, from crossing `begin` on. Words of more than `LESSENED` symbols keep the same
    number. NoOrbit is raised where no orbit was found.
    """
    n = len(system.signs)

    def tried(each: int) -> Chain:
        """The chain with `each` half rotations in every free passage."""
        cells = np.cumsum([first, *turns, *[each] * (n - len(turns))])
        return chain_through(system, cells, parameter, patient=False)

    made = alike(system.level, system.signs, tried, bool(turns), begin)
    cells = made.cells
    for k in range(len(turns), n if n <= LESSENED else 0):
        cells = lessened(system, made, cells, k, begin)
    # `lessened` looks at windows only: in case the whole does not exist, the first chain stands.
    if (cells != made.cells).any():
        with contextlib.suppress(NoOrbit):
            return chain_through(system, cells, made.parameter, patient=False)
    return made


def alike(
    level: ChainLevel,
    signs: Signs,
    tried: Callable[[int], Chain],
    some_given: bool = False,
    begin: int = 0,
) -> Chain:
    """The chain with the fewest half rotations, the same number in every free passage.

    ``tried(number)`` finds the chain with that number. Its crossings stay `INSIDE`, unless some
    passages are given; those before crossing `begin` may be anywhere. NoOrbit is raised where no
    chain was found.
    """
    split, reason = level.narrowest(signs), NoOrbit()
    if len(signs) > 1:
        # No length of the passages helps where roundings displace the crossings.
        check_split(level, split)
    # Of a chain with given passages, perhaps only these end where surfaces are split least.
    least = max(1, level.fewest_half_turns(level.splitting if some_given else split))
    most = max(1, level.fewest_half_turns(split)) + MORE_HALF_TURNS - 1
    for each in range(least, most + 1):
        try:
            made = tried(each)
        except NoOrbit as error:
            reason = error
            continue
        off = float(made.off_middle[begin:].max())
        if some_given or off <= INSIDE:
            return made
        reason = NoOrbit(f"a crossing is {off:.2f} half rotations from the middle of its cell")
    raise type(reason)(f"from {least} to {most} half rotations a passage: {reason}")


def lessened(system: System, made: Chain, cells: Signs, k: int, begin: int = 0) -> Signs:
    """The cells (n + 1,) with as few half rotations in passage k as its neighbours allow.

    The chain `made` may have other cells: only the passage that arrives before the window of
    neighbours is taken from it.
    """
    # A short chain, the window of passages that feel the change, stands for the whole.
    low, high = max(0, k - WINDOW), min(len(system.signs), k + 1 + WINDOW)
    part, parameter = system._replace(signs=system.signs[low:high]), made.parameter
    if low:
        # The window begins with the I of the passage before it, and an angle in the same place
        # relative to the new cell.
        I, shift = float(made.I[low - 1]), made.b[low - 1] - made.chi[low]
        part, parameter = part._replace(begin=partial(on_surface, I=I)), shift + np.pi * cells[low]
    while True:
        # One half rotation less in passage k moves all cells behind it.
        fewer = cells.copy()
        fewer[k + 1 :] -= 1
        try:
            near = chain_through(part, fewer[low : high + 1], parameter, patient=False)
        except NoOrbit:
            return cells
        if near.off_middle[max(0, begin - low) :].max() > INSIDE:
            return cells
        cells = fewer
