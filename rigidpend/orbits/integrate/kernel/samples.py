"""Kernel that carries orbits along and writes down where they are at given times."""

from __future__ import annotations

import ctypes
import functools
from typing import Any

from rigidpend.orbits.integrate.kernel import machine_code
from rigidpend.orbits.integrate.kernel.lane_numbers import Value
from rigidpend.orbits.integrate.kernel.machine_code import LANES, hexadecimal
from rigidpend.orbits.integrate.kernel.tape import ALIGNED, TracedField
from rigidpend.orbits.integrate.kernel.taylor_step import Kernel


@functools.cache
def function(order: int, bits: int, field: TracedField = ALIGNED, lanes: int = LANES) -> Any:
    """The kernel for series of an order, in numbers of so many bits.

    It is called with (state, stride, time, parameters, grid, all, apart, count, next, sense,
    groups, steps, samples), all pointers to doubles or int64, sense a double, and returns the
    number of lanes that have not reached the last of the times:

    - state, stride, time, parameters: of the field, as in the module `notes`;
    - grid, all, apart: `count` times t', in their order, of each lane `apart` doubles behind those
      of the one before: 0 where all have the same; of the parts of a time each is `all` doubles
      behind the one before;
    - next: of each lane, how many of them it has passed; kept up to date;
    - sense: 1 if the times ascend, -1 if they descend;
    - groups, steps: vectors of lanes, and steps for each of them at most;
    - samples: rows of `stride` doubles, for each time those of `state`.
    """
    array, count, number = machine_code.ArrayPointer, ctypes.c_int64, ctypes.c_double
    state = (array, count, array, array)
    kinds = (*state, array, count, count, count, array, number, count, count, array)
    return machine_code.function(_Sampling(order, bits, field, lanes).whole(), "sample", *kinds)


class _Sampling(Kernel):
    """The function `sample`."""

    def whole(self) -> str:
        """All of the text."""
        code = self.code
        self.begin()
        self.sense, self.never = code.everywhere("%sense"), code.number(float("inf"))
        self.due, self.found = (
            code.variable(self.numbers.rows(count * self.parts)) for count in (1, self.size)
        )
        self.left = code.variable("i64")
        code.store("0", self.left, "i64", 8)
        with code.loop("%groups") as group:
            self._group(code(f"mul i64 {group}, {code.lanes}"))
        head = (
            "define i64 @sample(ptr noalias %state, i64 %stride, ptr noalias %time,"
            " ptr noalias %parameters, ptr noalias %grid, i64 %all, i64 %apart, i64 %count,"
            " ptr noalias %next, double %sense, i64 %groups, i64 %steps, ptr noalias %samples) {"
        )
        return code.function(head, code.load(self.left, "i64", 8), self.field.functions)

    def _group(self, first: str) -> None:
        code = self.code
        places = self.places(first)
        self.load_lanes(places)
        with code.loop(code.lanes) as lane:
            self._set_due(first, lane)
        with code.loop("%steps"):
            open_ = code.compare("olt", code.size(code.load(self.due)), self.never)
            with code.when(self.any_lane(open_)[1]):
                self._step(first)
        self.store_lanes(places)
        with code.loop(code.lanes) as lane:
            passed = code.load(code.at("%next", code(f"add i64 {first}, {lane}"), "i64"), "i64", 8)
            more = code(f"zext i1 {code(f'icmp slt i64 {passed}, %count')} to i64")
            total = code(f"add i64 {code.load(self.left, 'i64', 8)}, {more}")
            code.store(total, self.left, "i64", 8)

    def _set_due(self, first: str, lane: str) -> None:
        """The time that a lane comes to next, or never."""
        code = self.code
        passed = code.load(code.at("%next", code(f"add i64 {first}, {lane}"), "i64"), "i64", 8)
        place = code.at(self.due, lane, "double")
        infinity = hexadecimal(float("inf"))
        code.store(code(f"fmul double %sense, {infinity}"), place, "double", 8)
        with code.when(code(f"icmp slt i64 {passed}, %count")):
            column = code(f"mul i64 {code(f'add i64 {first}, {lane}')}, %apart")
            row = code(f"add i64 {column}, {passed}")
            for part in range(self.parts):
                time = code.load(code.at("%grid", row, "double"), "double", 8)
                place = code.at(code.at(self.due, part), lane, "double")
                code.store(time, place, "double", 8)
                row = code(f"add i64 {row}, %all")

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
        self.go_on(h, [self.at(i, h) for i in range(self.size)])

    def _since(self) -> Value:
        """Time from the beginning of the step to what is due in each lane."""
        high, low = (self.numbers.of_double(self.code.load(x)) for x in self.time)
        due = self.numbers.load(self.due, 0)
        return self.numbers.minus(self.numbers.minus(due, high), low)

    def _write(self, first: str, since: Value, mask: str) -> None:
        """Write down where the lanes of a mask are at the time that is due."""
        code = self.code
        for i in range(self.size):
            self.numbers.store(self.at_number(i, since), self.found, i)
        bits = code(f"bitcast {code.mask} {mask} to i{code.lanes}")
        with self.each_lane(bits) as lane:
            self._write_lane(first, lane)

    def _write_lane(self, first: str, lane: str) -> None:
        code = self.code
        column = code(f"add i64 {first}, {lane}")
        counter = code.at("%next", column, "i64")
        passed = code.load(counter, "i64", 8)
        size = self.size
        row = code(f"mul i64 {passed}, {size * self.parts}")
        for i in range(size * self.parts):
            component, part = i % size, i // size
            offset = code(f"mul i64 {code(f'add i64 {row}, {i}')}, %stride")
            vector = code.at(self.found, component * self.parts + part)
            value = code.load(code.at(vector, lane, "double"), "double", 8)
            place = code.at("%samples", code(f"add i64 {offset}, {column}"), "double")
            code.store(value, place, "double", 8)
        code.store(code(f"add i64 {passed}, 1"), counter, "i64", 8)
        self._set_due(first, lane)
