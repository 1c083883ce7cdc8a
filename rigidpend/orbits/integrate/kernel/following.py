"""The two kernels that follow orbits: to crossings of M3 = 0, and to given times.

With c_k the Taylor coefficients of M3 on a step of length h, M3 has no zero on the step where
|c_0| > sum |c_k| h^k over k >= 1, nor where it is certainly monotone and has the same sign at both
ends. Every other step is noted with its series and, if M3 is monotone, its zero, for
`rigidpend.orbits.integrate.batch` and `step_crossings` to find the crossings.
"""

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

They are: the lane, t' at the step's beginning, the step's length, M3 at its end, and 1 if M3 is
monotone on it. Then follow, meaningful where M3 is monotone and changes its sign: the time from the
beginning to the zero of M3, Newton's last correction, and Qp and Qm at the zero. The time to the
zero includes the second double of the beginning's time, so that its sum with t' is rounded once."""
NEWTON = 4
"""Newton iterations from the zero of the chord, which has two digits; each doubles the digits."""
M3 = 2
"""Index of M3 among the components."""
MOMENTA = 3
"""Number of components whose series are noted: Qp, Qm and M3 tell a crossing."""


def note(order: int, bits: int) -> Any:
    """NumPy's type of a note, all doubles: the `FIELDS`, and series of Qp, Qm and M3 in t'."""
    series = ("series", float, (MOMENTA, order + 1, KINDS[bits].parts))
    return np.dtype([*((name, float) for name in FIELDS), series])


@functools.cache
def carrying(order: int, bits: int, lanes: int = LANES) -> Any:
    """The kernel that carries orbits some steps on and notes steps on which M3 may vanish.

    Series have the given order, numbers the given bits. The kernel is called with (state, stride,
    time, parameters, depth, groups, steps, notes) and returns the number of notes. `depth` is a
    double; stride, groups and steps are whole numbers; all others are arrays of doubles:

    - state: 6 rows of `stride` doubles for each part of a number, carried on in place;
    - time: 2 rows, t' and the rounding error of its sums;
    - parameters: the 9 `AlignedCoefficients`, for each part;
    - depth: steps on which |M3| may come down to this times |M| are noted too;
    - groups, steps: number of vectors of lanes, and number of steps for each of them;
    - notes: an array of `note`, with room for one on each step of each lane.
    """
    return _of_order(order, bits, _Carrying, ALIGNED, lanes)


@functools.cache
def sampling(order: int, bits: int, field: TracedField, lanes: int) -> Any:
    """The kernel that writes down the states of orbits of a field at given times.

    It is called with (state, stride, time, parameters, grid, all, apart, count, next, sense,
    groups, steps, samples) and returns the number of lanes that have not reached the last of their
    times. `sense` is a double, `next` an array of int64; state, time, parameters, grid and samples
    are arrays of doubles, and the rest are whole numbers:

    - state, stride, time, parameters: as in :func:`carrying`, but of this field;
    - grid, all, apart: `count` times t' in the order in which they come. A lane's times begin
      `apart` doubles behind those of the lane before: 0 where all lanes have the same. The parts of
      a time lie `all` doubles apart;
    - next: the number of times that each lane has passed; kept up to date;
    - sense: 1 if the times ascend, -1 if they descend;
    - groups, steps: number of vectors of lanes, and of steps for each of them at most;
    - samples: for each time rows of `stride` doubles, as those of `state`.
    """
    return _of_order(order, bits, _Sampling, field, lanes)


def _of_order(order: int, bits: int, *of: Any) -> Any:
    """A kernel for series of an order; its code is shared by all orders that have room in it."""
    return functools.partial(_compiled(room_for(order, bits), bits, *of), *of_order(order, bits))


@functools.cache
def _compiled(room: Room, bits: int, kind: Any, field: TracedField, lanes: int) -> Any:
    return machine_code.function(kind(room, bits, field, lanes).whole())


class _Carrying(Kernel):
    """Writer of the function `carry`."""

    def whole(self) -> str:
        """The text of the function."""
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
        # The note needs the series, whose order 0 `go_on` replaces by the end of the step.
        self._note_if_zero_is_possible(first, h, ends[2][0])
        self.go_on(h, ends)

    def _note_if_zero_is_possible(self, first: str, h: str, after: str) -> None:
        """Note the lanes on whose step M3 changes its sign or may touch zero.

        `after` is M3 at the end of the step.
        """
        code = self.code
        # With sizes |c_k| of the coefficients Horner's rule sums, from the highest order to 2,
        # reach = sum |c_k| h^(k-2), which bounds M3, and bend = sum k |c_k| h^(k-2), which bounds
        # its slope.
        slope = code.size(self.head(M3, 1))
        reach, bend = code.variable(code.vector), code.variable(code.vector)
        size = code.size(self.head(M3, "%order"))
        code.store(size, reach)
        code.store(self._so_often("%order", size), bend)
        with self.descending(2) as k:
            size = code.size(self.head(M3, k))
            code.store(code.fma(code.load(reach), h, size), reach)
            code.store(code.fma(code.load(bend), h, self._so_often(k, size)), bend)
        # far: |c_0| > depth + sum |c_k| h^k, where the depth is that of |Qp| + |Qm| + |M3|, which
        # is |M| at least. steady: |c_1| > sum k |c_k| h^(k-1) over k >= 2, so that the slope keeps
        # its sign. A NaN makes both false, and the step is noted.
        span = self._times(code.fma(code.load(reach), h, slope), h)
        for i in range(MOMENTA):
            span = code.fma(code.size(self.head(i, 0)), self.depth, span)
        far = code.compare("ogt", code.size(self.head(M3, 0)), span)
        steady = code.compare("ogt", slope, self._times(code.load(bend), h))
        # Noted where M3 is zero at an end of the step, too: `step_crossings.crosses` tells which.
        changed = code.compare("ole", self._times(self.head(M3, 0), after), "zeroinitializer")
        doubtful = code.logic("xor", code.logic("or", far, steady), code.everywhere("true", "i1"))
        mask, some = self.any_lane(code.logic("or", changed, doubtful))
        with code.when(some):
            # Computed for all lanes at once, of which only those of the mask are written.
            monotone = code(f"uitofp {code.mask} {steady} to {code.vector}")
            self._note(first, mask, (h, after, monotone, *self._zero(h, after)))

    def _so_often(self, k: str, size: str) -> str:
        """A double in each lane times the integer k."""
        return self._times(size, self.code.everywhere(self.code(f"sitofp i64 {k} to double")))

    def _zero(self, h: str, after: str) -> tuple[str, ...]:
        """Time from the beginning to the zero of M3, the last correction, and Qp, Qm there.

        Newton's method from the zero of the chord, in doubles. Where it fails, the last correction
        is large, and the caller isolates the zeros instead.
        """
        code, before = self.code, self.head(M3, 0)
        x, value, slope, correction = (code.variable(code.vector) for _ in range(4))
        code.store(self._times(h, code.binary("fdiv", before, self._minus(before, after))), x)
        with code.loop(NEWTON):
            at = code.load(x)
            code.store(self.head(M3, "%order"), value)
            code.store(code.number(0.0), slope)
            # Horner's rule for the value and, one order behind, for the derivative.
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
        """Write a note for each lane of a mask: number of the lane, time, `fields`, series."""
        code = self.code
        # Vectors hold one number for each lane, a note has all numbers of one lane side by side.
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
        """Copy one lane of `count` successive vectors to successive doubles."""
        code = self.code
        with code.loop(count) as i:
            code.keep(code.scalar(vectors, code.add(code.mul(i, code.lanes), lane)), to, i)


class _Sampling(Kernel):
    """Writer of the function `sample`."""

    def whole(self) -> str:
        """The text of the function."""
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
                # Steps are left out when no lane has a time to come to. Until then all lanes go on
                # together: one that is done is due at infinity and writes nothing.
                open_ = code.compare("olt", code.size(code.load(self.due)), self.never)
                with code.when(self.any_lane(open_)[1]):
                    self._step(first)
        with code.loop(code.lanes) as lane:
            passed = code.scalar("%next", code.add(first, lane), "i64")
            more = code(f"zext i1 {code(f'icmp slt i64 {passed}, %count')} to i64")
            code.store(code.add(code.load(self.left, "i64", 8), more), self.left, "i64", 8)

    def _set_due(self, first: str, lane: str) -> None:
        """Set the time that a lane comes to next; infinity in the sense of time if there is none.

        All parts of the time are set, of infinity only the first.
        """
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
        # A step may contain several of the times: repeated until no lane's next one lies on it.
        with code.repeated() as again:
            since = self._since()
            # A lane that is done has infinity here, or no number: neither is within the step.
            ahead = code.binary("fmul", since[0], self.sense)
            within = code.compare("ole", ahead, length)
            again.append(self.any_lane(within)[1])
            with code.when(again[0]):
                self._write(first, since, within)
        h = code.binary("fmul", length, self.sense)
        self.go_on(h, self.at(h, self.size))

    def _since(self) -> Value:
        """Time from the beginning of the step to the time that is due, in each lane."""
        # The large first part is subtracted first: the difference then keeps the digits of the
        # small second one.
        high, low = (self.numbers.of_double(self.code.load(x)) for x in self.time)
        due = self.numbers.load(self.due, 0)
        return self.numbers.minus(self.numbers.minus(due, high), low)

    def _write(self, first: str, since: Value, mask: str) -> None:
        """Write down the states of the lanes of a mask at the times that are due."""
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
        # Rows are those of `state`: the first parts of all components, then the second ones.
        for i in range(size * self.parts):
            component, part = i % size, i // size
            offset = code.mul(code.add(row, i), "%stride")
            value = code.scalar(code.at(self.found, component * self.parts + part), lane)
            code.keep(value, "%samples", code.add(offset, column))
        code.store(code.add(passed, 1), counter, "i64", 8)
        self._set_due(first, lane)
