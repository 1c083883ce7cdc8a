"""The two kernels: orbits carried on to crossings of M3 = 0, and to given times.

M3 may have been zero on a step where |c_0| <= sum |c_k| h^k over k >= 1, unless the sign is the
same at both ends and M3 certainly monotone between. A note has the step's series, and the zero if
there is one; see `rigidpend.orbits.integrate.passages`.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from rigidpend.orbits.integrate.kernel import machine_code
from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS, Value
from rigidpend.orbits.integrate.kernel.machine_code import LANES, hexadecimal
from rigidpend.orbits.integrate.kernel.tape import ALIGNED, TracedField
from rigidpend.orbits.integrate.kernel.taylor_step import Kernel, Room, of_order, room_for

FIELDS = ("lane", "time", "length", "after", "steady", "zero", "correction", "Qp", "Qm")
"""Contents of a note before the series.

They are: which lane, t' at the beginning, the step's length, M3 at its end, 1 if M3 is monotone,
and where it is the time of its zero from there on (with what the time leaves over, so that the
sum is rounded once), Newton's last correction, and Qp and Qm there."""
NEWTON = 4
"""Iterations from the chord's zero; each doubles the digits, of which the first has two."""
M3 = 2
"""Its place among the components."""
MOMENTA = 3
"""Number of components, Qp, Qm and M3, whose series are noted: they tell a crossing."""


def note(order: int, bits: int) -> Any:
    """Layout of a note, all doubles: the `FIELDS`, and the `MOMENTA` in powers of t'."""
    series = ("series", float, (MOMENTA, order + 1, KINDS[bits].parts))
    return np.dtype([*((name, float) for name in FIELDS), series])


@functools.cache
def carrying(order: int, bits: int, lanes: int = LANES) -> Any:
    """The kernel that notes steps, for series of an order, in numbers of so many bits.

    It is called with (state, stride, time, parameters, depth, groups, steps, notes), all arrays of
    doubles or int64, depth a double, and returns the number of notes:

    - state: 6 rows of `stride` doubles for each part of a number, carried on in place;
    - time: 2 rows, t' and what its last digit leaves over;
    - parameters: `AlignedCoefficients`, 9 for each part;
    - depth: a touch of M3 = 0 that is no deeper is noted too;
    - groups, steps: vectors of lanes, and steps for each of them;
    - notes: an array of `note`, with room for one on each step of each lane.
    """
    return _of_order(order, bits, _Carrying, ALIGNED, lanes)


@functools.cache
def sampling(order: int, bits: int, field: TracedField = ALIGNED, lanes: int = LANES) -> Any:
    """The kernel that writes down where orbits are at given times.

    It is called with (state, stride, time, parameters, grid, all, apart, count, next, sense,
    groups, steps, samples), all pointers to doubles or int64, sense a double, and returns the
    number of lanes that have not reached the last of the times:

    - state, stride, time, parameters: of the field, as in :func:`carrying`;
    - grid, all, apart: `count` times t', in their order, of each lane `apart` doubles behind those
      of the one before: 0 where all have the same; of the parts of a time each is `all` doubles
      behind the one before;
    - next: of each lane, how many of them it has passed; kept up to date;
    - sense: 1 if the times ascend, -1 if they descend;
    - groups, steps: vectors of lanes, and steps for each of them at most;
    - samples: rows of `stride` doubles, for each time those of `state`.
    """
    return _of_order(order, bits, _Sampling, field, lanes)


def _of_order(order: int, bits: int, *of: Any) -> Any:
    """A kernel for series of an order, whose code serves all that it has room for."""
    return functools.partial(_compiled(room_for(order, bits), bits, *of), *of_order(order, bits))


@functools.cache
def _compiled(room: Room, bits: int, kind: Any, field: TracedField, lanes: int) -> Any:
    return machine_code.function(kind(room, bits, field, lanes).whole())


class _Carrying(Kernel):
    """The function `carry`."""

    def whole(self) -> str:
        """All of the text."""
        code = self.code
        self.depth = code.everywhere("%depth")
        self.count = code.variable("i64")
        code.store("0", self.count, "i64", 8)
        with code.loop("%groups") as group:
            first = code.mul(group, code.lanes)
            with self.lanes_from(first), code.loop("%steps"):
                self._step(first)
        head = (
            f"define i64 @carry({self.HEAD}, ptr noalias %state, i64 %stride, ptr noalias %time,"
            " ptr noalias %parameters, double %depth, i64 %groups, i64 %steps,"
            " ptr noalias %notes) {"
        )
        return code.function(head, code.load(self.count, "i64", 8))

    def _step(self, first: str) -> None:
        self.expand()
        h = self.length()
        ends = self.at(h, self.size)
        self._note_if_zero_is_possible(first, h, ends[2][0])
        self.go_on(h, ends)

    def _note_if_zero_is_possible(self, first: str, h: str, after: str) -> None:
        """Note the lanes on whose step M3 changes its sign or may touch zero."""
        code = self.code
        slope = code.size(self.head(M3, 1))
        reach, bend = code.variable(code.vector), code.variable(code.vector)
        size = code.size(self.head(M3, "%order"))
        code.store(size, reach)
        code.store(self._so_often("%order", size), bend)
        with self.descending(2) as k:
            size = code.size(self.head(M3, k))
            code.store(code.fma(code.load(reach), h, size), reach)
            code.store(code.fma(code.load(bend), h, self._so_often(k, size)), bend)
        span = code.fma(code.load(reach), h, slope)
        far = code.compare("ogt", code.size(self.head(M3, 0)), code.fma(span, h, self.depth))
        steady = code.compare("ogt", slope, self._times(code.load(bend), h))
        zero = "zeroinitializer"
        begin, end = (code.compare("olt", x, zero) for x in (self.head(M3, 0), after))
        changed = code.logic("xor", begin, end)
        doubtful = code.logic("xor", code.logic("or", far, steady), code.everywhere("true", "i1"))
        mask, some = self.any_lane(code.logic("or", changed, doubtful))
        with code.when(some):
            monotone = code(f"uitofp {code.mask} {steady} to {code.vector}")
            self._note(first, mask, (h, after, monotone, *self._zero(h, after)))

    def _so_often(self, k: str, size: str) -> str:
        """A double in each lane, times a whole number."""
        return self._times(size, self.code.everywhere(self.code(f"sitofp i64 {k} to double")))

    def _zero(self, h: str, after: str) -> tuple[str, ...]:
        """Time from the beginning to the zero of M3, the last correction, and Qp, Qm there."""
        code, before = self.code, self.head(M3, 0)
        x, value, slope, correction = (code.variable(code.vector) for _ in range(4))
        code.store(self._times(h, code.binary("fdiv", before, self._minus(before, after))), x)
        with code.loop(NEWTON):
            at = code.load(x)
            code.store(self.head(M3, "%order"), value)
            code.store(code.number(0.0), slope)
            with self.descending() as k:
                last = code.load(value)
                code.store(code.fma(code.load(slope), at, last), slope)
                code.store(code.fma(last, at, self.head(M3, k)), value)
            code.store(code.binary("fdiv", code.load(value), code.load(slope)), correction)
            code.store(self._minus(at, code.load(correction)), x)
        zero = code.binary("fadd", code.load(x), code.load(self.time[1]))
        Qp, Qm = (number[0] for number in self.at(code.load(x), 2))
        return zero, code.load(correction), Qp, Qm

    def _note(self, first: str, mask: str, fields: tuple[str, ...]) -> None:
        """Write down the lanes of a mask, with what is told of each."""
        code = self.code
        length = code.mul(code.add("%order", 1), self.parts)
        width = code.add(code.mul(length, MOMENTA), len(FIELDS))
        told = code.variable(f"[{len(fields) + 1} x {code.vector}]")
        for i, value in enumerate((code.load(self.time[0]), *fields)):
            code.store(value, code.at(told, i))
        with self.each_lane(mask) as lane:
            count = code.load(self.count, "i64", 8)
            place = code.at("%notes", code.mul(count, width), "double")
            number = code(f"sitofp i64 {code.add(first, lane)} to double")
            code.store(number, place, "double", 8)
            self._copy(told, lane, code.at(place, 1, "double"), len(fields) + 1)
            for i, series in enumerate(self.component[:MOMENTA]):
                begin = code.add(code.mul(length, i), len(FIELDS))
                self._copy(series, lane, code.at(place, begin, "double"), length)
            code.store(code.add(count, 1), self.count, "i64", 8)

    def _copy(self, vectors: str, lane: str, to: str, count: int | str) -> None:
        """Copy one lane of successive vectors."""
        code = self.code
        with code.loop(count) as i:
            code.keep(code.scalar(vectors, code.add(code.mul(i, code.lanes), lane)), to, i)


class _Sampling(Kernel):
    """The function `sample`."""

    def whole(self) -> str:
        """All of the text."""
        code = self.code
        self.sense, self.never = code.everywhere("%sense"), code.number(float("inf"))
        self.due, self.found = (
            code.variable(self.numbers.rows(count * self.parts)) for count in (1, self.size)
        )
        self.left = code.variable("i64")
        code.store("0", self.left, "i64", 8)
        with code.loop("%groups") as group:
            self._group(code.mul(group, code.lanes))
        head = (
            f"define i64 @sample({self.HEAD}, ptr noalias %state, i64 %stride, ptr noalias %time,"
            " ptr noalias %parameters, ptr noalias %grid, i64 %all, i64 %apart, i64 %count,"
            " ptr noalias %next, double %sense, i64 %groups, i64 %steps, ptr noalias %samples) {"
        )
        return code.function(head, code.load(self.left, "i64", 8))

    def _group(self, first: str) -> None:
        code = self.code
        with self.lanes_from(first):
            with code.loop(code.lanes) as lane:
                self._set_due(first, lane)
            with code.loop("%steps"):
                open_ = code.compare("olt", code.size(code.load(self.due)), self.never)
                with code.when(self.any_lane(open_)[1]):
                    self._step(first)
        with code.loop(code.lanes) as lane:
            passed = code.scalar("%next", code.add(first, lane), "i64")
            more = code(f"zext i1 {code(f'icmp slt i64 {passed}, %count')} to i64")
            code.store(code.add(code.load(self.left, "i64", 8), more), self.left, "i64", 8)

    def _set_due(self, first: str, lane: str) -> None:
        """The time that a lane comes to next, or never."""
        code = self.code
        passed = code.scalar("%next", code.add(first, lane), "i64")
        place = code.at(self.due, lane, "double")
        infinity = hexadecimal(float("inf"))
        code.store(code(f"fmul double %sense, {infinity}"), place, "double", 8)
        with code.when(code(f"icmp slt i64 {passed}, %count")):
            row = code.add(code.mul(code.add(first, lane), "%apart"), passed)
            for part in range(self.parts):
                time = code.scalar("%grid", row)
                code.keep(time, code.at(self.due, part), lane)
                row = code.add(row, "%all")

    def _step(self, first: str) -> None:
        code = self.code
        self.expand()
        length = self.length()
        with code.repeated() as again:
            since = self._since()
            ahead = code.binary("fmul", since[0], self.sense)
            within = code.compare("ole", ahead, length)
            again.append(self.any_lane(within)[1])
            with code.when(again[0]):
                self._write(first, since, within)
        h = code.binary("fmul", length, self.sense)
        self.go_on(h, self.at(h, self.size))

    def _since(self) -> Value:
        """Time from the beginning of the step to what is due in each lane."""
        high, low = (self.numbers.of_double(self.code.load(x)) for x in self.time)
        due = self.numbers.load(self.due, 0)
        return self.numbers.minus(self.numbers.minus(due, high), low)

    def _write(self, first: str, since: Value, mask: str) -> None:
        """Write down where the lanes of a mask are at the time that is due."""
        code = self.code
        for i, value in enumerate(self.at_number(since)):
            self.numbers.store(value, self.found, i)
        bits = code(f"bitcast {code.mask} {mask} to i{code.lanes}")
        with self.each_lane(bits) as lane:
            self._write_lane(first, lane)

    def _write_lane(self, first: str, lane: str) -> None:
        code, size = self.code, self.size
        column = code.add(first, lane)
        counter = code.at("%next", column, "i64")
        passed = code.load(counter, "i64", 8)
        row = code.mul(passed, size * self.parts)
        for i in range(size * self.parts):
            component, part = i % size, i // size
            offset = code.mul(code.add(row, i), "%stride")
            value = code.scalar(code.at(self.found, component * self.parts + part), lane)
            code.keep(value, "%samples", code.add(offset, column))
        code.store(code.add(passed, 1), counter, "i64", 8)
        self._set_due(first, lane)
