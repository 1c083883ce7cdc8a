"""Crossings of the orbits of Fig. 4 by return maps instead of integration.

Maps of different design take the place of integrations in other units: their tables differ in
orders, nodes, arcs and units, so they share neither truncation nor rounding. A map covers the
energies of all phases, h0 + mu sin(theta2_0) but for terms of the order of mu J1_0.
"""

import contextlib
import functools
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np

from rigidpend.machine.workers import side_by_side
from rigidpend.numbers.exact import PRECISIONS, exact
from rigidpend.orbits.integrate import Crossings
from rigidpend.orbits.integrate.arithmetic import PAIRS
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map import MapError, ReturnMap, kernel, return_map
from rigidpend.orbits.return_map.build import FIRST, SECOND, THIRD, Costly, Design, expected_cost
from rigidpend.orbits.return_map.program import Program
from rigidpend.orbits.return_map.storage import build_apart, is_kept
from rigidpend.routes import costs, ladder
from rigidpend.routes.certainty import FIRST_SCALES, SCALES
from rigidpend.routes.ladder import Rung
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
Task: TypeAlias = tuple[int, Design]
"""The bits that a map's tables are built with, and its design."""


def designs_of(
    problem: RouteProblem, orbits: int, precisions: Sequence[int] = PRECISIONS
) -> list[Design]:
    """The designs of the maps that are made for so many orbits, for the layer of these."""
    # Where nothing follows doubles these decide whatever can be, and integration would be third.
    third = max(precisions) == 53 or costs.doubles_decide(problem)
    # Where no sharper map follows, integration does: it takes the longer the deeper passages are.
    needed = costs.wanted(problem)[0] == (53, 53)
    every = FIRST, SECOND, THIRD
    made = every[: 3 if needed or (third and orbits >= THIRDS) else 2]
    return [design._replace(narrower=narrower(problem)) for design in made]


def tasks_of(designs: list[Design], map_bits: tuple[int, int]) -> list[Task]:
    """The maps of some designs, for computations of the first and the second in so many bits.

    Where passages are deep the first map is as sharp as the second: its own computation leaves
    terms of it out, but orbits that are handed over to it get all of them.
    """
    first, second = map_bits
    built = max(map_bits) if first == costs.SHARPEST else first
    return list(zip((built, second, first), designs, strict=False))


def expected_tables(
    problem: RouteProblem, orbits: int, budget: float, precisions: Sequence[int] = PRECISIONS
) -> float:
    """Expected seconds of a core for the tables of the sharpest maps that take at most `budget`.

    Infinity where all take longer, or the orbits have no map.
    """
    with contextlib.suppress(MapError):
        check_start(problem)
        designs = designs_of(problem, orbits, precisions)
        for map_bits in costs.wanted(problem):
            tables = sum(_expected(problem, tasks_of(designs, map_bits)).values())
            if tables <= budget:
                return tables
    return math.inf


def _expected(problem: RouteProblem, tasks: list[Task]) -> dict[Task, float]:
    """Seconds of a core that each map is expected to take."""
    given = problem.body, *problem.energies
    return {task: expected_cost(*given, *task) for task in tasks}


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
        self._ready, self._budgets = dict[Task, Program](), dict[Task, float]()
        self._starts = MapStarts(run)
        self.designs = designs_of(run.problem, run.orbits, run.arithmetic.precisions)
        given = run.problem, orbits or run.orbits, run.arithmetic.precisions
        pays = math.inf if only_kept else costs.budget(*given)
        budget = pays if least_time else max(pays, LEAST_BUDGET)
        *more, least = costs.wanted(self.problem)
        for map_bits in more:
            # Maps that do not converge, or cost too much, give way to the next ones.
            with contextlib.suppress(MapError):
                self._make(map_bits, budget)
                break
        else:
            self._make(least, pays if least_time else math.inf)
        for scales in SCALES[:2]:
            # The first crossing of one orbit shows whether starts lie in the range of the normal
            # form. Orbits that leave the tables later are integrated.
            if not self.crossings(53, scales, np.arange(1)).separatrix[0, 0]:
                raise MapError(f"J1_0 = {float(run.problem.J1_0)} lies outside of the normal form")

    def _make(self, map_bits: tuple[int, int], budget: float) -> None:
        """Make maps of all designs, side by side where that pays.

        MapError is raised where the tables would take more than `budget` seconds of a core.
        """
        body, ends = self.problem.body, self.problem.energies
        tasks = tasks_of(self.designs, map_bits)
        self.map_bits, self.built_bits = map_bits, {design: bits for bits, design in tasks}
        missing = [task for task in tasks if not is_kept(body, *ends, *task)]
        if self.only_kept and missing:
            raise MapError("none is kept")
        expected = _expected(self.problem, tasks)
        total = sum(expected.values())
        if total > budget:
            raise Costly(total, budget)
        self._budgets |= {task: budget * (each / total) for task, each in expected.items()}
        missing.sort(key=expected.__getitem__, reverse=True)

        def prepare(task: Task) -> None:
            if task == missing[0]:
                self.map_of(*task)
            else:
                build_apart(body, ends, *task, self._budgets[task])

        # The longest is made in this process, the next ones in further ones beside it, and what is
        # left after these.
        beside = missing[: self.run.jobs]
        if len(beside) > 1 and expected[missing[0]] > LEAST_APART:
            side_by_side(prepare, (), False, beside, self.run.jobs)
        for task in tasks:
            self.map_of(*task)

    @functools.cached_property
    def by_bits(self) -> dict[int, tuple[Design, ...]]:
        """The maps that make the computations in each precision, in their order.

        A precision beyond doubles serves that is asked for, or far enough from those that are.
        """
        asked, (first, second) = self.run.arithmetic.precisions, self.map_bits
        one, other, *_ = every = tuple(self.designs)
        # Beyond doubles each map makes one computation. In the last precision, where three are
        # made, all maps serve as many bits as the least sharp of them has. A first map that is
        # built as sharp as the second makes a computation beside it.
        made = {
            first: every if first == asked[-1] and first < second else (one,),
            second: (other, one) if self.built_bits[one] == second else (other,),
        }
        beyond = {
            x: by for x, by in made.items() if x > 53 and (x in asked or ladder.fits(x, asked))
        }
        return {53: every} | beyond

    @property
    def most_bits(self) -> int:
        """Bits of the sharpest map that decides symbols."""
        return max(self.by_bits)

    @property
    def last(self) -> Design:
        """The map of the last computation that decides symbols; in doubles alone, the second."""
        return self.by_bits[self.most_bits][:2][-1]

    @functools.cached_property
    def ladder(self) -> list[Rung]:
        """Rungs up to the maps' most bits.

        Three computations are made in the last precision, and in doubles where no sharper map
        follows. Before that, one in the next precision settles more than a third in the same, and
        integration makes two. Each map makes one, but in doubles one alone does if two would decide
        few orbits.
        """
        asked, sharpest = self.run.arithmetic.precisions, self.most_bits
        most = dict.fromkeys(asked, 2) | {bits: len(by) for bits, by in self.by_bits.items()}
        if not costs.doubles_decide(self.problem):
            most[53] = 1
        most[asked[-1] if sharpest > 53 else 53] = 3
        return ladder.rungs(sorted(bits for bits in most if bits <= sharpest), most=most)

    @functools.cached_property
    def beyond(self) -> list[Rung]:
        """Rungs of integrations that decide what the maps leave open."""
        engine, _, asked = self.run.arithmetic
        sharpest, in_pairs, apart = self.most_bits, PAIRS, 0
        # Tables of a thin layer hold so many more digits of d than an integration does.
        known = sharpest + narrower(self.problem)
        twice = self.by_bits[sharpest] == tuple(self.designs[1::-1])
        if twice:
            # Of three computations an integration that both maps confirm has to be the sharpest.
            apart = ladder.COARSE_BITS
            in_pairs = ladder.KEPT_IN_PAIRS if costs.very_deep(self.problem) else PAIRS
        elif sharpest > 53:
            known += ladder.SHARPER_BY
        further = (x for x in asked if x > sharpest)
        found = ladder.integrations(engine, further, known, in_pairs, apart)
        # One computation on each rung but the last: one on the next settles more orbits than a
        # second one on the same.
        found[:-1] = [rung._replace(most=1) for rung in found[:-1]]
        if twice and found and found[0].more < ladder.MUCH_SHARPER:
            beside = functools.partial(self.crossings, sharpest, FIRST_SCALES)
            found[0] = found[0]._replace(beside=beside)
        return found

    def design_of(self, bits: int, scales: Scales) -> Design | None:
        """The design of the map for a computation in those bits and scales; None for none."""
        return dict(zip(SCALES, self.by_bits.get(bits, ()), strict=False)).get(scales)

    def crossings(self, bits: int, scales: Scales, columns: Any) -> Crossings:
        """The crossings of some columns, times t'; FAILED where an orbit leaves the tables."""
        design = self.design_of(bits, scales)
        assert design is not None
        given = *self._starts.of(bits, design, columns), self.problem.n_symbols + 1, self.run.jobs
        found = kernel.follow(self._program(bits, design), *given)
        return found._replace(time=found.time * float(exact(design.unit)))

    def onward(
        self, design: Design, columns: Any, states: Any, time: Any, count: int, *, rising: bool
    ) -> tuple[Any, Crossings]:
        """Follow columns from a known crossing by the map of a design.

        The columns cross M3 = 0, all upward (`rising`) or all downward, at `states` (6, N),
        dimensionless, and times t' (N,). The result is the separatrix of each of these, (N,), and
        the `count` crossings that follow, times t'.
        """
        bits = self.built_bits[design]
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
            design=design,
            budget=self._budgets.get((bits, design), math.inf),
        )

    def _program(self, bits: int, design: Design) -> Program:
        """The map of a design as the kernel reads it, in doubles or pairs of them."""
        if (bits, design) not in self._ready:
            made = self.map_of(self.built_bits[design], design)
            starts, coarse, (first, second) = self.run.starts, 0.0, self.map_bits
            one, other, *_ = self.designs
            if bits == first < second and design == one:
                # The first map leaves out terms until it errs 2^(difference of the bits) times as
                # much as the second, so that these differ by it whatever the second errs by.
                coarse = 2.0 ** (second - bits) * self.map_of(second, other).left_out
            # The table of starts covers their Qp, from that of the least J1_0 to the largest.
            ends = starts.least_problem if starts else self.problem, self.problem
            least, most = (beginning(end, design, made.bits).Qp for end in ends)
            self._ready[bits, design] = made.program(bits, least, most, coarse)
        return self._ready[bits, design]
