"""Crossings of the orbits of Fig. 4 by return maps instead of integration.

Maps of different design take the place of integrations in other units: their tables differ in
orders, nodes, arcs and units, so they share neither truncation nor rounding. In doubles up to
three maps are compared; in pairs of doubles each of two maps makes one computation, and the second
map has some bits more than the first. A map covers the energies of all phases, h0 + mu
sin(theta2_0) but for terms of the order of mu J1_0.
"""

from __future__ import annotations

import contextlib
import functools
import math
import threading
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np

from rigidpend.machine.workers import side_by_side
from rigidpend.numbers.exact import PRECISIONS, exact
from rigidpend.orbits.integrate import Crossings
from rigidpend.orbits.return_map import MapError, ReturnMap, kernel, return_map
from rigidpend.orbits.return_map.build import FIRST, SECOND, THIRD, Costly, Design, expected_cost
from rigidpend.orbits.return_map.precision import precision
from rigidpend.orbits.return_map.program import Program
from rigidpend.orbits.return_map.storage import build_apart, is_kept
from rigidpend.routes import costs
from rigidpend.routes.certainty import (
    COARSE_BITS,
    FIRST_SCALES,
    SECOND_SCALES,
    THIRD_SCALES,
    Third,
    kept_bits,
)
from rigidpend.routes.map_start import MapStarts, beginning, check_start
from rigidpend.routes.problem import RouteProblem, narrower
from rigidpend.routes.run import Run
from rigidpend.routes.start import Scales

THIRDS = 100_000
"""Number of orbits from which on a third map is made, if doubles decide many or all of them.

It spares one orbit in seven a computation in more bits. Its tables take 0.3 s of a core or more; it
saves 0.8 microseconds an orbit in this call and in those that follow."""
LEAST_APART = 0.3
"""Least build time of the longest map, seconds of a core, for which processes make the others.

Processes take about as long to begin."""
LEAST_BUDGET = 20.0
"""Seconds of a core that tables beyond doubles may take where maps are wanted but do not pay.

Near the largest mu that a map serves they take some minutes, and those in doubles some seconds."""
SHARPER_BY = 8
"""Bits by which a map beyond doubles is sharper than an integration in as many.

Its tables have six more (`build.SPARE_BITS`). With eight bodies at 4 to 9 rotations a passage some
2,000 orbits of 45 symbols were integrated in 8, 11, 13, 15 and 17 bits more than a map of 75 has.
The integration erred by more than R times its difference from the map in 0.33/R, 0.11/R, 0.04/R,
0.008/R and 0.001/R of them, for R of 0.3 to 10; beside maps of 64 and 72 bits it was the same. A
limit for all the bits between them would leave one in 700 to 20,000 of those that err by a radian
wrong; that for eight bits less leaves one in 110,000 to 680,000, and one in 56,000 with the worst
of the bodies. Beside maps of 82 bits, of deep passages, it leaves one in 70,000 at most."""
DESIGNS = {FIRST_SCALES: FIRST, SECOND_SCALES: SECOND, THIRD_SCALES: THIRD}
"""The map that takes the place of an integration in some scales; its unit of M is the same."""


def designs_of(
    problem: RouteProblem, orbits: int, precisions: Sequence[int] = PRECISIONS
) -> list[Design]:
    """The designs of the maps that are made for so many orbits."""
    # Where nothing follows doubles these decide whatever can be, and integration would be third.
    third = max(precisions) == 53 or costs.doubles_decide(problem)
    # Where no sharper map follows, integration does: it takes the longer the deeper passages are.
    needed = costs.wanted(problem)[0] == (53, 53)
    return [FIRST, SECOND, THIRD][: 3 if needed or (third and orbits >= THIRDS) else 2]


def expected_tables(
    problem: RouteProblem, orbits: int, budget: float, precisions: Sequence[int] = PRECISIONS
) -> float:
    """Expected seconds of a core for the tables of the sharpest maps that take at most `budget`.

    Infinity where all take longer, or the orbits have no map.
    """
    with contextlib.suppress(MapError):
        check_start(problem)
        for map_bits in costs.wanted(problem):
            designs = designs_of(problem, orbits, precisions)
            tables = sum(_expected(problem, _tasks(designs, map_bits)).values())
            if tables <= budget:
                return tables
    return math.inf


Task: TypeAlias = tuple[int, Design]
"""A map's bits and its design."""


def _tasks(designs: list[Design], map_bits: tuple[int, int]) -> list[Task]:
    """The maps of some designs, for computations of two numbers of bits."""
    return list(zip(costs.built_bits(map_bits), designs, strict=False))


def _narrowed(problem: RouteProblem, task: Task) -> Task:
    """A map's bits, and its design for the layer of a problem's orbits."""
    bits, design = task
    return bits, design._replace(narrower=narrower(problem))


def _expected(problem: RouteProblem, tasks: list[Task]) -> dict[Task, float]:
    """Seconds of a core that each map is expected to take."""
    given = problem.body, *problem.energies
    return {task: expected_cost(*given, *_narrowed(problem, task)) for task in tasks}


class Maps:
    """Return maps for orbits that start with J2_0 = sqrt(2 h0/kappa), as in Fig. 4.

    Parameters
    ----------
    run : Run
        The orbits, and the number of threads that make the maps.
    orbits : int, optional
        Number of orbits for which the maps have to pay; by default that of the run.
    least_time : bool, optional
        Whether maps are wanted only where they are expected to take less time than integration.
    only_kept : bool, optional
        Whether only maps that were built before are wanted.

    Raises
    ------
    MapError
        The orbits have no such map, none that pays, or none that is kept; or J1_0 is too large to
        begin in the normal form.
    """

    def __init__(
        self,
        run: Run,
        *,
        orbits: int | None = None,
        least_time: bool = False,
        only_kept: bool = False,
    ) -> None:
        check_start(run.problem)
        self.run, self.problem, self.only_kept = run, run.problem, only_kept
        self._lock, self._ready = threading.Lock(), dict[Task, Program]()
        self._budgets, self._starts = dict[Task, float](), MapStarts(run)
        self.designs = designs_of(run.problem, run.orbits, run.arithmetic.precisions)
        pays = costs.budget(run.problem, orbits or run.orbits, run.arithmetic.precisions)
        budget = math.inf if only_kept else pays if least_time else max(pays, LEAST_BUDGET)
        self._settle(budget, pays if least_time else math.inf)
        for scales in (FIRST_SCALES, SECOND_SCALES):
            # The first crossing of one orbit shows whether starts lie in the range of the normal
            # form. Orbits that leave the tables later are integrated.
            if not self.crossings(53, scales, np.arange(1)).separatrix[0, 0]:
                raise MapError(f"J1_0 = {float(run.problem.J1_0)} lies outside of the normal form")

    def _settle(self, budget: float, in_doubles: float) -> None:
        """Make the sharpest of the wanted maps that converge and are cheap enough.

        Their tables may take `budget` seconds of a core, those in doubles `in_doubles`."""
        *more, least = costs.wanted(self.problem)
        for map_bits in more:
            # Maps that do not converge, or cost too much, give way to the next ones.
            with contextlib.suppress(MapError):
                self._make(map_bits, budget)
                break
        else:
            self._make(least, in_doubles)
            map_bits = least
        self.map_bits, self.built_bits = map_bits, costs.built_bits(map_bits)
        asked = self.run.arithmetic.precisions

        def settles(bits: int) -> bool:
            return bits in asked or costs.fits(bits, asked)

        # A map makes one computation beyond doubles, and this settles symbols only if it is sharper
        # than the one before by enough bits.
        made = zip(map_bits, (FIRST, SECOND), strict=True)
        self.design_by_bits = {bits: design for bits, design in made if bits > 53 and settles(bits)}

    def _make(self, map_bits: tuple[int, int], budget: float) -> None:
        """Make maps of all designs, side by side where that pays.

        MapError is raised where the tables would take more than `budget` seconds of a core.
        """
        body, ends = self.problem.body, self.problem.energies
        own = functools.partial(_narrowed, self.problem)
        tasks = _tasks(self.designs, map_bits)
        missing = [task for task in tasks if not is_kept(body, *ends, *own(task))]
        if self.only_kept and missing:
            raise MapError("none is kept")
        expected = _expected(self.problem, tasks)
        total, longest = sum(expected.values()), max(expected, key=expected.__getitem__)
        if total > budget:
            raise Costly(total, budget)
        self._budgets |= {task: budget * (each / total) for task, each in expected.items()}

        def prepare(task: Task) -> None:
            if task == longest:
                self.map_of(*task)
            else:
                build_apart(body, ends, *own(task), self._budgets[task])

        # The longest is made in this process, and the others in further ones beside it.
        if self.run.jobs > 1 and len(missing) > 1 and expected[longest] > LEAST_APART:
            side_by_side(prepare, (), False, missing, self.run.jobs)
        for task in tasks:
            self.map_of(*task)

    @property
    def most_bits(self) -> int:
        """Bits of the sharpest map that decides symbols."""
        return max(self.design_by_bits, default=53)

    @property
    def beyond(self) -> tuple[int, ...]:
        """Precisions, ascending, of integrations that decide what the maps leave open."""
        # Of three computations an integration that both maps confirm has to be the sharpest.
        least = self.counted(self.most_bits) + (COARSE_BITS if self.twice else 0)
        ladder = self.run.beyond(self.most_bits, self.counted)
        return tuple(bits for bits in ladder if kept_bits(bits) >= least)

    def counted(self, bits: int) -> int:
        """The bits for which a computation counts beside a sharper one, by integration."""
        # Tables of a thin layer hold so many more digits of d than an integration does.
        more = narrower(self.problem) if bits in {53, *self.design_by_bits} else 0
        if self.twice:
            # Both maps are compared with the first integration, by limits for their own bits.
            return (kept_bits(bits) if costs.very_deep(self.problem) else bits) + more
        return bits + more + (SHARPER_BY if bits in self.design_by_bits else 0)

    @property
    def twice(self) -> bool:
        """True if both maps have the most bits, in which each of them makes one computation.

        With the one before, in fewer bits, these are three: see `certainty.LIMIT_OF_COARSE`.
        """
        sharpest = self.most_bits
        return self.design_by_bits.get(sharpest) == SECOND and self.built_bits[0] == sharpest

    @property
    def beside(self) -> Third | None:
        """The second map's computation in the most bits, where the first map's came last."""
        computed = functools.partial(self.crossings, self.most_bits, FIRST_SCALES)
        return computed if self.twice else None

    @property
    def last(self) -> int:
        """The map of the last computation that decides symbols: 0 the first, 1 the second.

        In doubles alone, it is the second one.
        """
        sharpest = self.design_by_bits.get(self.most_bits, SECOND)
        return 0 if self.twice else self.designs.index(sharpest)

    @property
    def ladder(self) -> tuple[int, ...]:
        """The precisions of the run and those of the maps, ascending."""
        return tuple(sorted({*self.run.arithmetic.precisions, *self.design_by_bits}))

    def most_computations(self, bits: int) -> int:
        """The largest number of computations in a precision.

        Three are made in the last precision, and in doubles where no sharper map follows. Before
        that, one in the next precision settles more than a third in the same, and integration makes
        two. Maps beyond doubles make one, or two in the most bits where they are `twice`. In
        doubles they make one if two would decide few orbits, else two, or three where there is a
        third map.
        """
        last = max(self.run.arithmetic.precisions)
        if bits in self.design_by_bits and bits < last:
            return 2 if self.twice and bits == self.most_bits else 1
        if bits == 53 and self.design_by_bits and not costs.doubles_decide(self.problem):
            return 1
        final = bits in (last, self.most_bits)
        return 3 if final or self.design_of(bits, THIRD_SCALES) else 2

    def design_of(self, bits: int, scales: Scales) -> Design | None:
        """The design of the map for a computation in those bits and scales; None for none."""
        design = DESIGNS.get(scales)
        # Beyond doubles `design_by_bits` says which map makes the first computation.
        if bits > 53 and scales == FIRST_SCALES:
            return self.design_by_bits.get(bits)
        if bits == self.most_bits and scales == SECOND_SCALES and self.twice:
            return FIRST
        # All maps serve as many bits as the least sharp of them has.
        return design if bits in (53, min(self.map_bits)) and design in self.designs else None

    def crossings(self, bits: int, scales: Scales, columns: Any) -> Crossings:
        """The crossings of some columns, times t'; FAILED where an orbit leaves the tables."""
        design = self.design_of(bits, scales)
        assert design is not None
        given = *self._starts.of(bits, design, columns), self.problem.n_symbols + 1, self.run.jobs
        found = kernel.follow(self._program(bits, design), *given)
        return found._replace(time=found.time * float(exact(design.unit)))

    def onward(
        self, which: int, columns: Any, states: Any, time: Any, count: int, *, rising: bool
    ) -> tuple[Any, Crossings]:
        """Follow columns from a known crossing by the first (0) or the second map (1).

        The columns cross M3 = 0, all upward (`rising`) or all downward, at `states` (6, N),
        dimensionless, and times t' (N,). The result is the separatrix of each of these, (N,), and
        the `count` crossings that follow, times t'.
        """
        bits, design = self.built_bits[which], self.designs[which]
        a, unit, made = precision(bits), Fraction(design.unit), self.map_of(bits, design)
        *_, e = self._starts.of(bits, design, columns)
        # d and chi do not depend on the length of gamma, which other scales change.
        x, chi, image = made.placed(rising, [*(states[:3] * unit), *states[3:]], e)
        at = kernel.UnderWay(rising, x, chi, image, a.array(time / float(unit)))
        found = kernel.go_on(self._program(bits, design), at, e, count, self.run.jobs)
        # image is 1 on separatrices 2 and 3, and -1 on 4 and 1.
        beside = (3 - image if rising else 2 + image).astype(np.uint8)
        return beside, found._replace(time=found.time * float(unit))

    def map_of(self, bits: int, design: Design) -> ReturnMap:
        """The map of a design over the energies of all phases, built if it is not kept."""
        return return_map(
            self.problem.body,
            h=self.problem.energies,
            bits=bits,
            design=_narrowed(self.problem, (bits, design))[1],
            budget=self._budgets.get((bits, design), math.inf),
        )

    def _program(self, bits: int, design: Design) -> Program:
        """The map of a design as the kernel reads it, in doubles or pairs of them."""
        # Several threads may ask for the same map: one makes it, and the others wait.
        with self._lock:
            if (bits, design) not in self._ready:
                made = self.map_of(self.built_bits[self.designs.index(design)], design)
                starts, coarse, (first, second) = self.run.starts, 0.0, self.map_bits
                if bits == first < second and design == FIRST:
                    # The first map leaves out terms until it errs 2^(difference of the bits) times
                    # as much as the second, so that these differ by it whatever the second errs by.
                    coarse = 2.0 ** (second - bits) * self.map_of(second, SECOND).left_out
                # The table of starts covers their Qp, from that of the least J1_0 to the largest.
                ends = starts.least_problem if starts else self.problem, self.problem
                least, most = (beginning(end, design, made.bits).Qp for end in ends)
                self._ready[bits, design] = made.program(bits, least, most, coarse)
            return self._ready[bits, design]
