"""Kernel that follows many orbits through a map's passages, in machine code of the package's own.

The code of a passage is written once, for any map: tables, their orders and all else of a body are
data (`program`), so that nothing is compiled anew for another body. The energy of an orbit is
the same on all its passages. So the tables are summed over their Chebyshev polynomials in the
energy only once for each orbit, which makes them short.

The kernel computes in doubles or in pairs of doubles, `LANES` orbits side by side in a vector. A
call cannot be interrupted, so that it takes a bounded time, and leaves its orbits in a state from
which the next call goes on.
"""

import functools
import itertools
from typing import Any, NamedTuple

import numpy as np

from rigidpend.machine.workers import check_stop, side_by_side
from rigidpend.numbers import Scalar
from rigidpend.orbits.integrate import Crossings, Outcome
from rigidpend.orbits.integrate.kernel import machine_code
from rigidpend.orbits.integrate.kernel.lane_numbers import Value
from rigidpend.orbits.integrate.kernel.machine_code import LANES
from rigidpend.orbits.integrate.sum_arrays import SumArray
from rigidpend.orbits.return_map.kernel_sums import Sums
from rigidpend.orbits.return_map.program import FUNCTIONS, LEG, RATES, TABLE, Program

AT_ONCE = 2**15
"""Number of passages in a call: some 0.01 s in doubles, 0.2 s in pairs."""
WORTHWHILE = {53: 2**13, 106: 2**10}
"""Number of passages that are worth a thread, which takes 0.1 ms to begin and as long to end."""
ROWS = X, PHASE, ENERGY, FACTOR, TIME, IMAGE, INSIDE = range(7)
"""Rows of the array of states in which orbits are kept between two calls.

FACTOR is Qp of a start, by which functions in the table of starts are divided, and then 1.
IMAGE is 1 on separatrix 2 or 3 and -1 on 4 or 1. INSIDE is 1 until an orbit leaves the tables, and
0 from then on."""

HEAD = (
    "define i64 @follow(ptr noalias %legs, ptr noalias %harmonics, ptr noalias %lengths,"
    " ptr noalias %values, ptr noalias %bases, i64 %apart, i64 %triples, i64 %vectors,"
    " i64 %energies, ptr noalias %limits, ptr noalias %orbits, i64 %stride, i64 %groups,"
    " i64 %begun, i64 %crossings, ptr noalias %room, ptr noalias %times,"
    " ptr noalias %separatrices) {"
)
"""The function's first line: the data of a program, the orbits, room to work in, and results.

`%apart` is the distance between parts of a coefficient, `%stride` that between rows of orbits, and
`%begun` the number of the first leg: 0 for orbits at a start, then odd from upward crossings."""


class UnderWay(NamedTuple):
    """Orbits at a crossing of M3 = 0, described as if on separatrix 2 (rising) or 3."""

    rising: bool
    x: Any
    """(N,) d in units of the width of the next table, -1 to 1."""
    chi: Any
    """(N,) radians."""
    image: Any
    """(N,) doubles: 1 on these separatrices, -1 on their images, 4 and 1."""
    time: Any
    """(N,) time t' since the start, in the map's unit."""


def follow(
    program: Program, Qp: Scalar, phase: Scalar, e: Scalar, crossings: int, jobs: int = 1
) -> Crossings:
    """Follow orbits from their starts to their first `crossings` crossings of M3 = 0.

    Times t' are in the map's unit. An orbit that leaves the tables has no crossings from there on,
    and its outcome is FAILED.

    Parameters
    ----------
    program : Program
    Qp : (N,) array
        Dimensionless starts in the map's unit, within the program's starts. These and the further
        arrays are doubles or pairs of doubles.
    phase : (N,) array
        psi of the mirrored start, radians.
    e : (N,) array
        Energies, from -1 to 1 over the map's interval.
    crossings : int
    jobs : int, optional
        Number of threads, which share the orbits. Only the kernel runs in them: threads that take
        turns with the interpreter would wait longer than they compute.
    """
    begin = np.stack((program.starts.place(Qp), phase, e, Qp, 0 * Qp))
    return _carried(program, begin, np.ones(len(phase)), 0, crossings, jobs)


def go_on(program: Program, at: UnderWay, e: Scalar, crossings: int, jobs: int = 1) -> Crossings:
    """Follow orbits from a crossing of M3 = 0 to `crossings` further ones: see :func:`follow`."""
    # The leg from a downward crossing is a mirrored one, and takes (d, -chi).
    side = 1 if at.rising else -1
    begin = np.stack((at.x, side * at.chi, e, 0 * at.x + 1, at.time))
    return _carried(program, begin, at.image, 1 if at.rising else 2, crossings, jobs)


def _carried(
    program: Program, begin: Any, image: Any, number: int, crossings: int, jobs: int
) -> Crossings:
    """Carry orbits on from their states, rows X to TIME; `number` is that of their next leg."""
    n = begin.shape[-1]
    groups = -(-n // LANES)
    stride = groups * LANES
    parts = len(program.values)
    # Lanes without an orbit are computed too, from zeros, and their results are dropped.
    rows = np.zeros((parts, len(ROWS), stride))
    rows[:, : len(begin), :n] = SumArray.of(begin).parts[:parts]
    rows[0, [IMAGE, INSIDE]] = 1.0
    rows[0, IMAGE, :n] = image
    times = np.empty((crossings, stride))
    beside = np.empty((crossings, stride), dtype=np.uint8)
    # Vectors for which the kernel needs room: see `Sums.make_room`.
    waves = 2 * max(1, program.harmonics[:, 0].max())
    vectors = program.vectors + (program.energies + waves) * parts
    passages = _passages(program)
    # A call takes `abreast` groups of orbits, or one group for `further` of its crossings.
    further = max(1, AT_ONCE // LANES)
    abreast = max(1, further // max(1, crossings))

    def carry(some: range) -> None:
        # Each thread has its own room, from a multiple of 64 bytes on: that of a vector.
        room = np.empty(vectors * LANES + 8)
        aligned = room[-room.ctypes.data % 64 // room.itemsize :]
        for group in some[::abreast]:
            here, groups = group * LANES, min(abreast, some.stop - group)
            for k in range(0, crossings, further):
                check_stop()
                counts = stride, groups, number + k, min(further, crossings - k)
                passages(rows[:, :, here:], *counts, aligned, times[k:, here:], beside[k:, here:])

    worth = groups * crossings * LANES // WORTHWHILE[program.bits]
    threads = max(1, min(jobs, groups, worth))
    ends = [groups * k // threads for k in range(threads + 1)]
    side_by_side(carry, (), False, [range(*x) for x in itertools.pairwise(ends)], threads)
    # An orbit that has left the tables never comes back: the last crossing tells of all.
    outcome = np.where(beside[-1, :n] != 0, Outcome.COMPLETE, Outcome.FAILED)
    return Crossings(times[:, :n], beside[:, :n], outcome.astype(np.uint8))


def _passages(program: Program) -> Any:
    """The kernel's function with a program's data as its first arguments."""
    return functools.partial(
        _function(program.bits),
        program.legs,
        program.harmonics,
        program.lengths,
        program.values,
        program.bases,
        program.values.shape[1] * FUNCTIONS,
        len(program.lengths),
        program.vectors,
        program.energies,
        program.limits,
    )


@functools.cache
def _function(bits: int) -> Any:
    return machine_code.function(_Following(bits).whole())


class _Following(Sums):
    """The text of the kernel's function, in LLVM's language.

    Registers hold values within a leg; what goes on from leg to leg, or in a loop, is in variables.
    """

    def whole(self) -> str:
        """The whole text of the function."""
        code, n = self.code, self.numbers
        one = n.rows(self.parts)
        self.x, self.phase, self.factor, self.time = (code.variable(one) for _ in range(4))
        self.along, self.angle, self.begin, self.rotation = (code.variable(one) for _ in range(4))
        self.image, self.inside = code.variable(code.vector), code.variable(code.vector)
        self.kept = {X: self.x, PHASE: self.phase, FACTOR: self.factor, TIME: self.time}
        self.one = code.number(1.0)
        self.make_room()
        with code.loop("%groups") as group:
            first = code.mul(group, LANES)
            self._begin(first)
            with code.loop("%crossings") as k:
                self._pass(k, first)
            self._leave(first)
        return code.function(HEAD, "0")

    def _begin(self, first: str) -> None:
        """Read the states of a group of orbits, and sum the tables at their energies."""
        code, n = self.code, self.numbers
        for row, variable in self.kept.items():
            n.store(self._known(row, first), variable, 0)
        code.store(self._known(IMAGE, first)[0], self.image)
        code.store(self._known(INSIDE, first)[0], self.inside)
        self.tables_at(self._known(ENERGY, first))

    def _leave(self, first: str) -> None:
        """Write the states of a group of orbits."""
        code, n = self.code, self.numbers
        for row, variable in self.kept.items():
            for value, place in zip(n.load(variable, 0), self._places(row, first), strict=True):
                code.store(value, place, align=8)
        code.store(code.load(self.image), self._places(IMAGE, first)[0], align=8)
        code.store(code.load(self.inside), self._places(INSIDE, first)[0], align=8)

    def _known(self, row: int, first: str) -> Value:
        """A row of the states of a group of orbits, read."""
        return tuple(self.code.load(place, align=8) for place in self._places(row, first))

    def _places(self, row: int, first: str) -> list[str]:
        """The addresses of the parts of a row of the states, for a group of orbits."""
        code = self.code
        begins = [code.mul("%stride", len(ROWS) * part + row) for part in range(self.parts)]
        return [code.at("%orbits", code.add(begin, first), "double") for begin in begins]

    def _pass(self, k: str, first: str) -> None:
        """Follow a leg: from one crossing to the next, or from the start to the first one."""
        code, n = self.code, self.numbers
        # Leg 0 leads from the start to an upward crossing, so odd numbers leave upward ones.
        number = code.add(k, "%begun")
        odd = code(f"and i64 {number}, 1")
        later = code(f"select i1 {code(f'icmp eq i64 {odd}, 1')}, i64 1, i64 2")
        leg = code(f"select i1 {code(f'icmp eq i64 {number}, 0')}, i64 0, i64 {later}")
        x, phase = (n.load(place, 0) for place in (self.x, self.phase))
        self._stay_inside(x[0], self.one)
        n.store(x, self.along, 0)
        n.store(phase, self.angle, 0)
        with code.loop(2) as side:
            # The way into the normal form and the way out of it look up a table each. A loop makes
            # one copy of these long lines serve both.
            entries = self._entries(leg, code.mul(side, TABLE), TABLE)
            found = self.table(entries, n.load(self.along, 0), n.load(self.angle, 0))
            with code.when(code(f"icmp eq i64 {side}, 0")):
                self._into(found, leg, phase)
            with code.when(code(f"icmp eq i64 {side}, 1")):
                self._out(found, leg, phase)
        self._tell(k, odd, first)

    def _entries(self, leg: str, first: str | int, count: int) -> list[str]:
        """Some of the integers that describe a leg, from the `first` on."""
        code = self.code
        at = code.add(code.mul(leg, LEG), first)
        return [code.scalar("%legs", code.add(at, j), "i64") for j in range(count)]

    def _into(self, found: list[Value], leg: str, phase: Value) -> None:
        """Go through the normal form: find I and s from the functions of the first table."""
        n, f = self.numbers, self.functions
        W, other, begin = found
        factor = n.load(self.factor, 0)
        W, other = n.times(W, factor), n.times(other, factor)
        # Only the table of starts is one of quotients: W and the other, divided by Qp.
        n.store(self.number(1.0), self.factor, 0)
        I = n.times(W, other)
        self._stay_inside(I[0], self.one)
        self._stay_inside(W[0], self._limit(leg, 0))
        self._turn_sides(W[0])
        # s = phase - ln|W|/Lambda; of the depth the kernel finds the part from W near 1, and the
        # tables have the rest.
        reciprocal, rest, rotation = self.rates(self._entries(leg, 2 * TABLE, RATES), I)
        depth = n.plus(n.times(f.logarithm_of_size(W), reciprocal), rest)
        n.store(I, self.along, 0)
        n.store(n.minus(phase, depth), self.angle, 0)
        n.store(begin, self.begin, 0)
        n.store(rotation, self.rotation, 0)

    def _out(self, found: list[Value], leg: str, phase: Value) -> None:
        """Go to the next crossing: its place and time, from the functions of the second table."""
        n = self.numbers
        there, beyond, end = found
        new = n.plus(n.load(self.angle, 0), beyond)
        # Whole turns were left out of the depth, and so of s: what chi has grown by needs them.
        # In doubles their second part is below rounding.
        turns = (self._limit(leg, 1), *(self._limit(leg, 2),) * (self.parts - 1))
        turned = n.minus(n.minus(new, phase), turns)
        begin, rotation = (n.load(x, 0) for x in (self.begin, self.rotation))
        taken = n.plus(n.minus(begin, end), n.times(rotation, turned))
        n.store(n.plus(n.load(self.time, 0), taken), self.time, 0)
        # The next passage is past the other orbit, which the reversor takes to the upper one:
        # chi becomes -chi.
        self._go_on(there, self.functions.reduced_angle(n.opposite(new)))

    def _go_on(self, x: Value, phase: Value) -> None:
        """Set the place of the next crossing, or zeros for orbits beyond the tables."""
        # Chebyshev polynomials grow beyond all bounds outside of a table, and angles would be too
        # large to be reduced by whole numbers of turns.
        mask = self.code.compare("ogt", self.code.load(self.inside), "zeroinitializer")
        for value, place in ((x, self.x), (phase, self.phase)):
            kept = tuple(self.code.chosen(mask, part, "zeroinitializer") for part in value)
            self.numbers.store(kept, place, 0)

    def _turn_sides(self, W: str) -> None:
        """Turn to the mirror image if W < 0: the sign of W tells on which side the orbit leaves."""
        code = self.code
        image, negative = code.load(self.image), code.compare("olt", W, "zeroinitializer")
        other = code(f"fneg {code.vector} {image}")
        code.store(self.code.chosen(negative, other, image), self.image)
        # An orbit with W = 0 is on the stable manifold and never leaves. The comparison is false
        # for NaN too.
        self._stay(code.compare("one", W, "zeroinitializer"))

    def _tell(self, k: str, odd: str, first: str) -> None:
        """Write the times at which the orbits cross, and beside which separatrices.

        For an orbit beyond the tables they are NaN and 0.
        """
        code = self.code
        inside = code.load(self.inside)
        mask = code.compare("ogt", inside, "zeroinitializer")
        image, place = code.load(self.image), code.mul(k, "%stride")
        place = code.add(place, first)
        # Upward beside 2 or its image 4, downward beside 3 or its image 1; image is 1 or -1.
        rising = code.binary("fsub", code.number(3.0), image)
        falling = code.binary("fadd", code.number(2.0), image)
        down = code.everywhere(code(f"icmp eq i64 {odd}, 1"), "i1")
        beside = code.binary("fmul", self.code.chosen(down, falling, rising), inside)
        small = f"<{LANES} x i8>"
        whole = code(f"fptoui {code.vector} {beside} to {small}")
        code.store(whole, code.at("%separatrices", place, "i8"), small, 1)
        time = self.code.chosen(mask, code.element(self.time, 0), code.number(float("nan")))
        code.store(time, code.at("%times", place, "double"), align=8)

    def _limit(self, leg: str, which: int) -> str:
        """A limit of a leg, in each lane: 0 the largest |W|, 1 and 2 the parts of its turns."""
        code = self.code
        return code.everywhere(code.scalar("%limits", code.add(code.mul(leg, 3), which)))

    def _stay_inside(self, x: str, limit: str) -> None:
        self._stay(self.code.compare("ole", self.code.size(x), limit))

    def _stay(self, mask: str) -> None:
        """Mark the orbits for which a condition does not hold as outside of the tables."""
        now = self.code.load(self.inside)
        self.code.store(self.code.chosen(mask, now, "zeroinitializer"), self.inside)
