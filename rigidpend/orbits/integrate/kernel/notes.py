"""Kernel that carries orbits on and notes the steps on which M3 may have been zero.

It may have been where |c_0| <= sum |c_k| h^k over k >= 1, unless the sign is the same at both
ends and M3 certainly monotone between. A note has the step's series, and the zero if there is
one; see `rigidpend.orbits.integrate.passages`.
"""

from __future__ import annotations

import ctypes
import functools
from typing import Any

from rigidpend.orbits.integrate.kernel import machine_code
from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS
from rigidpend.orbits.integrate.kernel.machine_code import LANES
from rigidpend.orbits.integrate.kernel.tape import ALIGNED
from rigidpend.orbits.integrate.kernel.taylor_step import Kernel

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


def width_of_note(order: int, bits: int) -> int:
    """Number of doubles in a note: the fields, and the parts of the series."""
    return len(FIELDS) + MOMENTA * (order + 1) * KINDS[bits].parts


@functools.cache
def function(order: int, bits: int) -> Any:
    """The kernel for series of an order, in numbers of so many bits.

    It is called with (state, stride, time, parameters, depth, groups, steps, notes), all arrays of
    doubles or int64, depth a double, and returns the number of notes:

    - state: 6 rows of `stride` doubles for each part of a number, carried on in place;
    - time: 2 rows, t' and what its last digit leaves over;
    - parameters: `AlignedCoefficients`, 9 for each part;
    - depth: a touch of M3 = 0 that is no deeper is noted too;
    - groups, steps: vectors of lanes, and steps for each of them;
    - notes: rows of `width_of_note` doubles, room for one on each step of each lane; the series
      are those of the first `MOMENTA` components.
    """
    array, count, number = machine_code.ArrayPointer, ctypes.c_int64, ctypes.c_double
    kinds = (array, count, array, array, number, count, count, array)
    return machine_code.function(_Carrying(order, bits, ALIGNED).whole(), "carry", *kinds)


class _Carrying(Kernel):
    """The function `carry`."""

    def whole(self) -> str:
        """All of the text."""
        code = self.code
        self.begin()
        self.depth = code.everywhere("%depth")
        self.count = code.variable("i64")
        code.store("0", self.count, "i64", 8)
        with code.loop("%groups") as group:
            first = code(f"mul i64 {group}, {LANES}")
            places = self.places(first)
            self.load_lanes(places)
            with code.loop("%steps"):
                self._step(first)
            self.store_lanes(places)
        head = (
            "define i64 @carry(ptr noalias %state, i64 %stride, ptr noalias %time,"
            " ptr noalias %parameters, double %depth, i64 %groups, i64 %steps,"
            " ptr noalias %notes) {"
        )
        return code.function(head, code.load(self.count, "i64", 8), self.field.functions)

    def _step(self, first: str) -> None:
        self.expand()
        h = self.length()
        ends = [self.at(i, h) for i in range(self.size)]
        self._note_if_zero_is_possible(first, h, ends[2][0])
        self.go_on(h, ends)

    def _note_if_zero_is_possible(self, first: str, h: str, after: str) -> None:
        """Note the lanes on whose step M3 changes its sign or may touch zero."""
        code = self.code
        sizes = [code.size(self.head(M3, k)) for k in range(self.order + 1)]
        reach, bend = sizes[-1], self._times(sizes[-1], code.number(float(self.order)))
        for k in range(self.order - 1, 0, -1):
            reach = code.fma(reach, h, sizes[k])
            if k > 1:
                bend = code.fma(bend, h, self._times(sizes[k], code.number(float(k))))
        far = code.compare("ogt", sizes[0], code.fma(reach, h, self.depth))
        steady = code.compare("ogt", sizes[1], self._times(bend, h))
        zero = "zeroinitializer"
        begin, end = (code.compare("olt", x, zero) for x in (self.head(M3, 0), after))
        changed = code.logic("xor", begin, end)
        doubtful = code.logic("xor", code.logic("or", far, steady), code.everywhere("true", "i1"))
        mask, some = self.any_lane(code.logic("or", changed, doubtful))
        with code.when(some):
            self._note(first, mask, (h, after, code.one_where(steady), *self._zero(h, after)))

    def _zero(self, h: str, after: str) -> tuple[str, ...]:
        """Time from the beginning to the zero of M3, the last correction, and Qp, Qm there."""
        code, before = self.code, self.head(M3, 0)
        x = self._times(h, code.binary("fdiv", before, self._minus(before, after)))
        for _ in range(NEWTON):
            value, slope = self._value_and_slope(x)
            correction = code.binary("fdiv", value, slope)
            x = self._minus(x, correction)
        zero = code.binary("fadd", x, code.load(self.time[1]))
        return zero, correction, *(self.at(i, x)[0] for i in range(2))

    def _value_and_slope(self, x: str) -> tuple[str, str]:
        """M3 and its derivative by Horner's rule."""
        code = self.code
        value, slope = self.head(M3, self.order), code.number(0.0)
        for k in range(self.order - 1, -1, -1):
            slope = code.fma(slope, x, value)
            value = code.fma(value, x, self.head(M3, k))
        return value, slope

    def _note(self, first: str, mask: str, fields: tuple[str, ...]) -> None:
        """Write down the lanes of a mask, with what is told of each."""
        code = self.code
        time = code.load(self.time[0])
        told = code.variable(f"[{len(FIELDS)} x {code.vector}]")
        for i, value in enumerate((time, *fields), start=1):
            code.store(value, code.at(told, i))
        with self.each_lane(mask) as lane:
            self._note_lane(first, lane, told)

    def _note_lane(self, first: str, lane: str, told: str) -> None:
        code = self.code
        width = width_of_note(self.order, self.numbers.bits)
        count = code.load(self.count, "i64", 8)
        note = code.at("%notes", code(f"mul i64 {count}, {width}"), "double")
        number = code(f"sitofp i64 {code(f'add i64 {first}, {lane}')} to double")
        code.store(number, note, "double", 8)
        self._copy(told, lane, note, 1, len(FIELDS), 0)
        self._copy(self.series, lane, note, len(FIELDS), width, len(FIELDS))
        code.store(code(f"add i64 {count}, 1"), self.count, "i64", 8)

    def _copy(self, vectors: str, lane: str, to: str, begin: int, end: int, shift: int) -> None:
        """Copy one lane of successive vectors to places `begin` to `end` of a note."""
        code = self.code
        with code.loop(end, begin) as i:
            row = code(f"mul i64 {code(f'sub i64 {i}, {shift}')}, {LANES}")
            place = code.at(vectors, code(f"add i64 {row}, {lane}"), "double")
            code.store(code.load(place, "double", 8), code.at(to, i, "double"), "double", 8)
