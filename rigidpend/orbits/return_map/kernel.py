"""Kernel that follows many orbits through a map's passages, in machine code of our own.

What a passage does is written once, for any map: tables, their orders and all else of a body are
data (`program`), so that nothing is compiled anew for another body. The energy of an orbit is
the same on all its passages: tables are summed over their Chebyshev polynomials in the energy
once for each orbit, and are short then.

It computes in doubles, or in pairs of them. A call takes a bounded time, for it cannot be
interrupted, and leaves its orbits where the next one goes on.
"""

from __future__ import annotations

import functools
import itertools
from typing import Any, NamedTuple

import numpy as np

from rigidpend.machine.workers import check_stop, side_by_side
from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.integrate import Crossings, Outcome
from rigidpend.orbits.integrate.kernel import machine_code
from rigidpend.orbits.integrate.kernel.lane_numbers import Value
from rigidpend.orbits.integrate.kernel.machine_code import LANES
from rigidpend.orbits.integrate.pair_arrays import in_doubles
from rigidpend.orbits.return_map.kernel_sums import Sums
from rigidpend.orbits.return_map.program import FUNCTIONS, RATES, STAGE, TABLE, Program

AT_ONCE = 2**15
"""Passages of a call: some 0.01 s in doubles, 0.2 s in pairs."""
WORTHWHILE = {53: 2**13, 106: 2**10}
"""Passages that are worth a thread, which takes 0.1 ms to begin and as long to end."""
ROWS = X, PHASE, ENERGY, FACTOR, TIME, IMAGE, INSIDE = range(7)
"""Rows of an orbit's state between two calls."""

HEAD = (
    "define i64 @follow(ptr noalias %stages, ptr noalias %harmonics, ptr noalias %lengths,"
    " ptr noalias %values, i64 %apart, i64 %triples, i64 %energies, ptr noalias %limits,"
    " ptr noalias %orbits, i64 %stride, i64 %groups, i64 %begun, i64 %crossings,"
    " ptr noalias %room,"
    " ptr noalias %times, ptr noalias %separatrices) {"
)


class UnderWay(NamedTuple):
    """Orbits at a crossing of M3 = 0, described as if on separatrix 2 (rising) or 3."""

    rising: bool
    x: Any
    """(N,) d over the width of the table that comes next, -1 to 1."""
    chi: Any
    """(N,) radians."""
    image: Any
    """(N,) doubles: 1 on these separatrices, -1 beside their images, 4 and 1."""
    time: Any
    """(N,) since the start, in the map's unit."""


def follow(
    program: Program, Qp: Scalar, phase: Scalar, e: Scalar, crossings: int, jobs: int = 1
) -> Crossings:
    """Follow orbits from their start to so many crossings of M3 = 0.

    Times are in the map's unit. There is no crossing where the tables do not reach so far, and the
    orbit is FAILED.

    Parameters
    ----------
    program : Program
    Qp : (N,) array
        Doubles or pairs of them, as are all: in the map's unit, within the program's starts.
    phase : (N,) array
        psi of the mirrored start, radians.
    e : (N,) array
        Energies, -1 to 1 in the map's interval.
    crossings : int
    jobs : int, optional
        Threads, which share the orbits. Python's own lines are left to one: threads that take
        turns with the interpreter wait longer than they compute.
    """
    begin = np.stack((program.starts.place(Qp), phase, e, Qp, 0 * Qp))
    return _carried(program, begin, np.ones(len(phase)), 0, crossings, jobs)


def go_on(program: Program, at: UnderWay, e: Scalar, crossings: int, jobs: int = 1) -> Crossings:
    """Follow orbits from a crossing of M3 = 0 to so many further ones: see :func:`follow`."""
    side = 1 if at.rising else -1
    begin = np.stack((at.x, side * at.chi, e, 0 * at.x + 1, at.time))
    return _carried(program, begin, at.image, 1 if at.rising else 2, crossings, jobs)


def _carried(
    program: Program, begin: Any, image: Any, number: int, crossings: int, jobs: int
) -> Crossings:
    """Carry orbits on from their rows up to the time; `number` tells which leg is their next."""
    n = begin.shape[-1]
    groups = -(-n // LANES)
    stride = groups * LANES
    parts = len(program.values)
    rows = np.zeros((parts, len(ROWS), stride))
    rows[:, : len(begin), :n] = in_doubles(begin, parts)
    rows[0, [IMAGE, INSIDE]] = 1.0
    rows[0, IMAGE, :n] = image
    times = np.empty((crossings, stride))
    beside = np.empty((crossings, stride), dtype=np.uint8)
    most = len(program.lengths) * FUNCTIONS + program.energies + 2 * max(1, program.most)
    passages = _passages(program)
    further = max(1, AT_ONCE // LANES)
    abreast = max(1, further // max(1, crossings))

    def carry(some: range) -> None:
        room = np.empty(most * parts * LANES + 8)
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
    outcome = np.where(beside[-1, :n] != 0, Outcome.COMPLETE, Outcome.FAILED)
    return Crossings(times[:, :n], beside[:, :n], outcome.astype(np.uint8))


def _passages(program: Program) -> Any:
    """The kernel's function, with all of a program as its first arguments."""
    return functools.partial(
        _function(program.bits),
        program.stages,
        program.harmonics,
        program.lengths,
        program.values,
        program.values.shape[1] * FUNCTIONS,
        len(program.lengths),
        program.energies,
        program.limits,
    )


@functools.cache
def _function(bits: int) -> Any:
    return machine_code.function(_Following(bits).whole())


class _Following(Sums):
    """The function `follow`."""

    def whole(self) -> str:
        """All of the text."""
        code, n = self.code, self.numbers
        one = n.rows(self.parts)
        self.x, self.phase, self.factor, self.time = (code.variable(one) for _ in range(4))
        self.along, self.angle, self.begin, self.rotation = (code.variable(one) for _ in range(4))
        self.image, self.inside = code.variable(code.vector), code.variable(code.vector)
        self.kept = {X: self.x, PHASE: self.phase, FACTOR: self.factor, TIME: self.time}
        self.one = code.number(1.0)
        self.make_room()
        with code.loop("%groups") as group:
            first = code(f"mul i64 {group}, {LANES}")
            self._begin(first)
            with code.loop("%crossings") as k:
                self._pass(k, first)
            self._leave(first)
        return code.function(HEAD, "0")

    def _begin(self, first: str) -> None:
        """Take in a group of orbits, and the tables at their energies."""
        code, n = self.code, self.numbers
        for row, variable in self.kept.items():
            n.store(self._known(row, first), variable, 0)
        code.store(self._known(IMAGE, first)[0], self.image)
        code.store(self._known(INSIDE, first)[0], self.inside)
        self.tables_at(self._known(ENERGY, first))

    def _leave(self, first: str) -> None:
        """Write down where a group of orbits is."""
        code, n = self.code, self.numbers
        for row, variable in self.kept.items():
            for value, place in zip(n.load(variable, 0), self._places(row, first), strict=True):
                code.store(value, place, align=8)
        code.store(code.load(self.image), self._places(IMAGE, first)[0], align=8)
        code.store(code.load(self.inside), self._places(INSIDE, first)[0], align=8)

    def _known(self, row: int, first: str) -> Value:
        return tuple(self.code.load(place, align=8) for place in self._places(row, first))

    def _places(self, row: int, first: str) -> list[str]:
        """Places of the parts of a number of each orbit of a group."""
        code, found = self.code, []
        for part in range(self.parts):
            begin = code(f"mul i64 %stride, {len(ROWS) * part + row}")
            found.append(code.at("%orbits", code(f"add i64 {begin}, {first}"), "double"))
        return found

    def _pass(self, k: str, first: str) -> None:
        """From one crossing to the next, the first from the start: a leg."""
        code, n = self.code, self.numbers
        number = code(f"add i64 {k}, %begun")
        odd = code(f"and i64 {number}, 1")
        later = code(f"select i1 {code(f'icmp eq i64 {odd}, 1')}, i64 1, i64 2")
        stage = code(f"select i1 {code(f'icmp eq i64 {number}, 0')}, i64 0, i64 {later}")
        x, phase = (n.load(place, 0) for place in (self.x, self.phase))
        self._stay_inside(x[0], self.one)
        n.store(x, self.along, 0)
        n.store(phase, self.angle, 0)
        with code.loop(2) as side:
            # Into the normal form and out of it: the same lines for two tables.
            entries = self._entries(stage, code.mul(side, TABLE), TABLE)
            found = self.table(entries, n.load(self.along, 0), n.load(self.angle, 0))
            with code.when(code(f"icmp eq i64 {side}, 0")):
                self._into(found, stage, phase)
            with code.when(code(f"icmp eq i64 {side}, 1")):
                self._out(found, stage, phase)
        self._tell(k, odd, first)

    def _entries(self, stage: str, first: str | int, count: int) -> list[str]:
        """Some of the whole numbers that describe a stage."""
        code = self.code
        at = code.add(code.mul(stage, STAGE), first)
        return [code.scalar("%stages", code.add(at, j), "i64") for j in range(count)]

    def _into(self, found: list[Value], stage: str, phase: Value) -> None:
        """Through the normal form, from what the first table has found: I and s."""
        n, f = self.numbers, self.functions
        W, other, begin = found
        factor = n.load(self.factor, 0)
        W, other = n.times(W, factor), n.times(other, factor)
        n.store(self.number(1.0), self.factor, 0)
        I = n.times(W, other)
        self._stay_inside(I[0], self.one)
        self._stay_inside(W[0], self._limit(stage, 0))
        self._turn_sides(W[0])
        reciprocal, rest, rotation = self.rates(self._entries(stage, 2 * TABLE, RATES), I)
        depth = n.plus(n.times(f.logarithm_of_size(W), reciprocal), rest)
        n.store(I, self.along, 0)
        n.store(n.minus(phase, depth), self.angle, 0)
        n.store(begin, self.begin, 0)
        n.store(rotation, self.rotation, 0)

    def _out(self, found: list[Value], stage: str, phase: Value) -> None:
        """To the next crossing, from what the second table has found: its place and time."""
        n = self.numbers
        there, beyond, end = found
        new = n.plus(n.load(self.angle, 0), beyond)
        turns = (self._limit(stage, 1), *(self._limit(stage, 2),) * (self.parts - 1))
        turned = n.minus(n.minus(new, phase), turns)
        begin, rotation = (n.load(x, 0) for x in (self.begin, self.rotation))
        taken = n.plus(n.minus(begin, end), n.times(rotation, turned))
        n.store(n.plus(n.load(self.time, 0), taken), self.time, 0)
        self._go_on(there, self.functions.reduced_angle(n.opposite(new)))

    def _go_on(self, x: Value, phase: Value) -> None:
        """The next crossing's place; of orbits beyond the tables a place that does no harm."""
        mask = self.code.compare("ogt", self.code.load(self.inside), "zeroinitializer")
        for value, place in ((x, self.x), (phase, self.phase)):
            kept = tuple(self.code.chosen(mask, part, "zeroinitializer") for part in value)
            self.numbers.store(kept, place, 0)

    def _turn_sides(self, W: str) -> None:
        """The sign of W tells on which side the orbit leaves."""
        code = self.code
        image, negative = code.load(self.image), code.compare("olt", W, "zeroinitializer")
        other = code(f"fneg {code.vector} {image}")
        code.store(self.code.chosen(negative, other, image), self.image)
        self._stay(code.compare("one", W, "zeroinitializer"))

    def _tell(self, k: str, odd: str, first: str) -> None:
        """Write down when and beside which separatrix the orbits cross."""
        code = self.code
        inside = code.load(self.inside)
        mask = code.compare("ogt", inside, "zeroinitializer")
        image, place = code.load(self.image), code(f"mul i64 {k}, %stride")
        place = code(f"add i64 {place}, {first}")
        # Upward beside 2 or its image 4, downward beside 3 or its image 1.
        rising = code.binary("fsub", code.number(3.0), image)
        falling = code.binary("fadd", code.number(2.0), image)
        down = code.everywhere(code(f"icmp eq i64 {odd}, 1"), "i1")
        beside = code.binary("fmul", self.code.chosen(down, falling, rising), inside)
        small = f"<{LANES} x i8>"
        whole = code(f"fptoui {code.vector} {beside} to {small}")
        code.store(whole, code.at("%separatrices", place, "i8"), small, 1)
        time = self.code.chosen(mask, code.element(self.time, 0), code.number(float("nan")))
        code.store(time, code.at("%times", place, "double"), align=8)

    def _limit(self, stage: str, which: int) -> str:
        code = self.code
        return code.everywhere(code.scalar("%limits", code.add(code.mul(stage, 3), which)))

    def _stay_inside(self, x: str, limit: str) -> None:
        self._stay(self.code.compare("ole", self.code.size(x), limit))

    def _stay(self, mask: str) -> None:
        """Orbits stay inside of the tables where a condition holds."""
        now = self.code.load(self.inside)
        self.code.store(self.code.chosen(mask, now, "zeroinitializer"), self.inside)
