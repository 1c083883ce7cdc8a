"""Text of the kernel: Taylor steps of many orbits in the language of LLVM, vectors of lanes.

It is the aligned field of `rigidpend.equations.aligned` as recurrences of Taylor coefficients
(products become sums over j of a_j b_(k-j)), written once for any order. A step's length follows
Jorba and Zou, Experimental Mathematics 14 (2005), sec. 3.2, as in heyoka. Lanes never meet: an
orbit comes out the same to the last bit whatever its neighbours, and on every processor, for
each sum and product is spelled out and nothing is left to a mathematical library.

Of each step it looks whether M3 may have been zero on it: where |c_0| <= sum |c_k| h^k over
k >= 1, unless the sign is the same at both ends and M3 certainly monotone between. Such a step
is noted with its series; see `passages`.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from contextlib import contextmanager

from rigidpend.equations import AlignedCoefficients

LANES = 8
"""Doubles in a vector: one of AVX-512, two of AVX2, four of NEON."""
LONGEST = 32.0
"""Longest step, t'; only an orbit that stands still comes to it."""
LOGARITHM = (-1025.4983531488, 4.0292113911, -2.0783351683, 0.6260321822, -0.0784406762)
"""log2 x - 1023 on [1, 2) within 1.2e-4, from its values at Chebyshev's points."""
POWER = (0.9999002882, 0.6963247711, 0.2246931558, 0.0789672570)
"""2^x on [0, 1) within 1e-4, likewise."""
FIELDS = ("lane", "time", "length", "after", "steady", "zero", "correction", "Qp", "Qm")
"""What a note holds before the series: which lane, t' at the beginning, the step's length, M3 at
its end, 1 if M3 is monotone, and where it is: the time of its zero from there on with Newton's
last correction, Qp and Qm at the zero."""
NEWTON = 4
"""Iterations from the chord's zero; each doubles the digits, of which the first has two."""
COMPONENTS = ("Qp", "Qm", "M3", "gamma1", "gamma2", "gamma3")
NOTED = 3
"""So many components' series are noted, the first ones."""


def order_of(tolerance: float) -> int:
    """Order of the series that is best for a local tolerance (Jorba and Zou, eq. 3.8)."""
    return max(4, math.ceil(1 - math.log(tolerance) / 2))


def width_of_note(order: int) -> int:
    """Number of doubles in a note."""
    return len(FIELDS) + NOTED * (order + 1)


def text(order: int) -> str:
    """The kernel's text for series of an order.

    It defines ``carry(state, stride, time, coefficients, depth, groups, steps, notes)``, all
    pointers to doubles or int64, depth a double, and returns the number of notes:

    - state: 6 rows of `stride` doubles, carried on in place, lanes side by side;
    - time: 2 rows, t' and what its last digit leaves over;
    - coefficients: 9, of `AlignedCoefficients`;
    - depth: a touch of M3 = 0 that is no deeper is noted too;
    - groups, steps: vectors of lanes, and steps for each of them;
    - notes: rows of `width_of_note` doubles, room for one on each step of each lane.
    """
    return _Kernel(order).whole()


class _Writer:
    """Lines of LLVM's language; each value that a line makes has a register of its own.

    What changes in a loop is a variable in memory: LLVM itself moves it to a register.
    """

    def __init__(self, lanes: int) -> None:
        self.vector = f"<{lanes} x double>"
        self.mask, self.whole = f"<{lanes} x i1>", f"<{lanes} x i64>"
        self.suffix, self.lanes = f"v{lanes}f64", lanes
        self.variables: list[str] = []
        self.lines: list[str] = []
        self.made = 0

    def __call__(self, line: str) -> str:
        """A line that makes a value; the value's register."""
        self.made += 1
        self.lines.append(f"  %r{self.made} = {line}")
        return f"%r{self.made}"

    def do(self, line: str) -> None:
        self.lines.append(f"  {line}")

    def variable(self, kind: str) -> str:
        self.made += 1
        self.variables.append(f"  %v{self.made} = alloca {kind}, align 64")
        return f"%v{self.made}"

    def at(self, base: str, index: str | int, kind: str = "") -> str:
        """The place of an element."""
        return self(f"getelementptr {kind or self.vector}, ptr {base}, i64 {index}")

    def load(self, place: str, kind: str = "", align: int = 64) -> str:
        return self(f"load {kind or self.vector}, ptr {place}, align {align}")

    def store(self, value: str, place: str, kind: str = "", align: int = 64) -> None:
        self.do(f"store {kind or self.vector} {value}, ptr {place}, align {align}")

    def element(self, base: str, index: str | int) -> str:
        return self.load(self.at(base, index))

    def binary(self, operation: str, a: str, b: str) -> str:
        return self(f"{operation} {self.vector} {a}, {b}")

    def fma(self, a: str, b: str, c: str) -> str:
        """a b + c, rounded once."""
        v = self.vector
        return self(f"call {v} @llvm.fma.{self.suffix}({v} {a}, {v} {b}, {v} {c})")

    def size(self, a: str) -> str:
        return self(f"call {self.vector} @llvm.fabs.{self.suffix}({self.vector} {a})")

    def compare(self, relation: str, a: str, b: str) -> str:
        return self(f"fcmp {relation} {self.vector} {a}, {b}")

    def larger(self, a: str, b: str) -> str:
        return self._chosen(self.compare("ogt", a, b), a, b)

    def smaller(self, a: str, b: str) -> str:
        return self._chosen(self.compare("olt", a, b), a, b)

    def _chosen(self, mask: str, a: str, b: str) -> str:
        return self(f"select {self.mask} {mask}, {self.vector} {a}, {self.vector} {b}")

    def logic(self, operation: str, a: str, b: str) -> str:
        return self(f"{operation} {self.mask} {a}, {b}")

    def one_where(self, mask: str) -> str:
        """1 in the lanes of a mask, 0 elsewhere."""
        return self(f"uitofp {self.mask} {mask} to {self.vector}")

    def number(self, value: float) -> str:
        """The same number in each lane."""
        return self.everywhere(_hexadecimal(value))

    def everywhere(self, value: str, kind: str = "double") -> str:
        """A scalar in each lane."""
        several = f"<{self.lanes} x {kind}>"
        first = self(f"insertelement {several} poison, {kind} {value}, i32 0")
        return self(
            f"shufflevector {several} {first}, {several} poison, "
            f"<{self.lanes} x i32> zeroinitializer"
        )

    @contextmanager
    def loop(self, end: str | int, start: str | int = 0) -> Iterator[str]:
        """Lines that are repeated for each whole number from `start` to below `end`."""
        counter, name = self.variable("i64"), f"loop{self.made}"
        self.store(str(start), counter, "i64", 8)
        self._jump(f"{name}.head")
        self._label(f"{name}.head")
        index = self.load(counter, "i64", 8)
        goes_on = self(f"icmp slt i64 {index}, {end}")
        self.do(f"br i1 {goes_on}, label %{name}.body, label %{name}.end")
        self._label(f"{name}.body")
        yield index
        self.store(self(f"add i64 {index}, 1"), counter, "i64", 8)
        self._jump(f"{name}.head")
        self._label(f"{name}.end")

    @contextmanager
    def when(self, condition: str) -> Iterator[None]:
        """Lines that are passed over unless a condition holds."""
        self.made += 1
        name = f"when{self.made}"
        self.do(f"br i1 {condition}, label %{name}.yes, label %{name}.end")
        self._label(f"{name}.yes")
        yield
        self._jump(f"{name}.end")
        self._label(f"{name}.end")

    def _jump(self, label: str) -> None:
        self.do(f"br label %{label}")

    def _label(self, name: str) -> None:
        self.lines.append(f"{name}:")


def _hexadecimal(value: float) -> str:
    """A double as LLVM reads it exactly."""
    return "0x" + struct.pack(">d", value).hex().upper()


class _Kernel:
    """The parts of the kernel, in the order in which they run."""

    def __init__(self, order: int) -> None:
        self.order, self.code = order, _Writer(LANES)
        code = self.code
        self.series = code.variable(f"[{len(COMPONENTS)} x [{order + 1} x {code.vector}]]")
        self.component = {}
        self.turning = {
            name: code.variable(f"[{order + 1} x {code.vector}]")
            for name in ("omega1", "omega2", "omega3")
        }

    def whole(self) -> str:
        code, v = self.code, self.code.vector
        for i, name in enumerate(COMPONENTS):
            self.component[name] = code.at(self.series, i * (self.order + 1))
        self._constants()
        self.count = code.variable("i64")
        code.store("0", self.count, "i64", 8)
        with code.loop("%groups") as group:
            self._group(code(f"mul i64 {group}, {LANES}"))
        result = code.load(self.count, "i64", 8)
        head = (
            f"declare {v} @llvm.fma.{code.suffix}({v}, {v}, {v})\n"
            f"declare {v} @llvm.fabs.{code.suffix}({v})\n"
            f"declare {v} @llvm.floor.{code.suffix}({v})\n"
            "define i64 @carry(ptr noalias %state, i64 %stride, ptr noalias %time,"
            " ptr noalias %coefficients, double %depth, i64 %groups, i64 %steps,"
            " ptr noalias %notes) {\nentry:"
        )
        body = [head, *code.variables, *code.lines, f"  ret i64 {result}", "}"]
        return "\n".join(body) + "\n"

    def _constants(self) -> None:
        code = self.code
        each = [
            code.everywhere(code.load(code.at("%coefficients", i, "double"), "double", 8))
            for i in range(len(AlignedCoefficients._fields))
        ]
        c = self.c = AlignedCoefficients(*each)
        # Products with omega1, omega2, omega3 in place of Qp + Qm, Qp - Qm, M3.
        self.half_sigma = code.binary("fdiv", c.half_sigma, c.kappa)
        both = code.binary("fmul", c.omega1, c.omega2)
        self.twist = code.binary("fdiv", c.twist, both)
        self.depth = code.everywhere("%depth")
        self.one = code.number(1.0)
        self.inverse = code.variable(f"[{self.order + 1} x double]")
        for k in range(1, self.order + 1):
            place = code.at(self.inverse, k, "double")
            code.store(_hexadecimal(1 / k), place, "double", 8)

    def _group(self, first: str) -> None:
        """Steps of one vector of lanes, from lane `first` on."""
        code = self.code
        places = []
        for i, name in enumerate(COMPONENTS):
            row = code(f"mul i64 %stride, {i}")
            place = code.at("%state", code(f"add i64 {row}, {first}"), "double")
            places.append(place)
            code.store(code.load(place, align=8), self.component[name])
        high = code.at("%time", first, "double")
        low = code.at("%time", code(f"add i64 %stride, {first}"), "double")
        self.time = code.variable(code.vector), code.variable(code.vector)
        for variable, place in zip(self.time, (high, low), strict=True):
            code.store(code.load(place, align=8), variable)
        with code.loop("%steps"):
            self._step(first)
        for name, place in zip(COMPONENTS, places, strict=True):
            code.store(code.load(self.component[name]), place, align=8)
        for variable, place in zip(self.time, (high, low), strict=True):
            code.store(code.load(variable), place, align=8)

    def _step(self, first: str) -> None:
        code = self.code
        with code.loop(self.order) as k:
            self._next_coefficients(k)
        h = self._length()
        ends = [self._at(name, h) for name in COMPONENTS]
        self._note_if_zero_is_possible(first, h, ends[2])
        for name, end in zip(COMPONENTS, ends, strict=True):
            code.store(end, self.component[name])
        self._let_time_pass(h)

    def _next_coefficients(self, k: str) -> None:
        """Coefficients of order k + 1 from those up to k: ``aligned``, term by term."""
        code, c = self.code, self.c
        Qp, Qm, M3 = (code.element(self.component[x], k) for x in COMPONENTS[:3])
        turning = (
            code.binary("fmul", c.omega1, code.binary("fadd", Qp, Qm)),
            code.binary("fmul", c.omega2, code.binary("fsub", Qp, Qm)),
            code.binary("fmul", c.kappa, M3),
        )
        for place, value in zip(self.turning.values(), turning, strict=True):
            code.store(value, code.at(place, k))
        total = self._products(k)
        gamma1, gamma2, gamma3 = (code.element(self.component[x], k) for x in COMPONENTS[3:])
        times, minus, fma = self._times, self._minus, code.fma
        rates = (
            minus(times(c.force_p, gamma3), times(self.half_sigma, total["3p"])),
            minus(times(self.half_sigma, total["3m"]), times(c.force_m, gamma3)),
            minus(fma(c.mu_r2, gamma1, times(self.twist, total["12"])), times(c.mu_r1, gamma2)),
            minus(total["3b"], total["2c"]),
            minus(total["1c"], total["3a"]),
            minus(total["2a"], total["1b"]),
        )
        following = code(f"add i64 {k}, 1")
        share = code.load(code.at(self.inverse, following, "double"), "double", 8)
        share = code.everywhere(share)
        for name, rate in zip(COMPONENTS, rates, strict=True):
            code.store(times(rate, share), code.at(self.component[name], following))

    def _products(self, k: str) -> dict[str, str]:
        """Coefficients of order k of the nine products: of omega_i with Qp, Qm, gamma (a, b, c)."""
        code = self.code
        names = ("3p", "3m", "12", "3b", "2c", "1c", "3a", "2a", "1b")
        sums = {name: code.variable(code.vector) for name in names}
        for place in sums.values():
            code.store("zeroinitializer", place)
        with code.loop(code(f"add i64 {k}, 1")) as j:
            other = code(f"sub i64 {k}, {j}")
            left = {
                i: code.element(x, j) for i, x in zip("123", self.turning.values(), strict=True)
            }
            letters = dict(zip("pm", COMPONENTS[:2], strict=True))
            letters |= dict(zip("abc", COMPONENTS[3:], strict=True))
            right = {x: code.element(self.component[y], other) for x, y in letters.items()}
            right["2"] = code.element(self.turning["omega2"], other)
            for (i, x), place in sums.items():
                value = code.fma(left[i], right[x], code.load(place))
                code.store(value, place)
        return {name: code.load(place) for name, place in sums.items()}

    def _times(self, a: str, b: str) -> str:
        return self.code.binary("fmul", a, b)

    def _minus(self, a: str, b: str) -> str:
        return self.code.binary("fsub", a, b)

    def _length(self) -> str:
        """Length of the step: the last two coefficients tell the radius of convergence."""
        code, p = self.code, self.order
        norm = code.larger(self._norm(0), self.one)
        size = self._binary_logarithm(norm)
        exponents = [
            self._times(
                self._minus(size, self._binary_logarithm(self._norm(m))), code.number(1 / m)
            )
            for m in (p - 1, p)
        ]
        shrink = code.number((-0.7 / (p - 1) - 2) / math.log(2))
        exponent = code.binary("fadd", code.smaller(*exponents), shrink)
        longest = code.number(math.log2(LONGEST))
        return self._power_of_two(code.smaller(exponent, longest))

    def _norm(self, m: int) -> str:
        """Largest coefficient of an order."""
        code = self.code
        sizes = [code.size(code.element(self.component[x], m)) for x in COMPONENTS]
        norm = sizes[0]
        for size in sizes[1:]:
            norm = code.larger(size, norm)
        return norm

    def _binary_logarithm(self, x: str) -> str:
        """log2 x to 1e-3, from the exponent and a polynomial of the rest: enough for a length."""
        code, n = self.code, LANES
        bits = code(f"bitcast {code.vector} {x} to {code.whole}")
        part = code.everywhere(str((1 << 52) - 1), "i64")
        rest = code(f"and {code.whole} {bits}, {part}")
        one = code.everywhere(str(1023 << 52), "i64")
        rest = code(f"or {code.whole} {rest}, {one}")
        rest = code(f"bitcast {code.whole} {rest} to {code.vector}")
        shift = code.everywhere("52", "i64")
        exponent = code(f"lshr {code.whole} {bits}, {shift}")
        exponent = code(f"uitofp <{n} x i64> {exponent} to {code.vector}")
        return code.binary("fadd", exponent, self._polynomial(LOGARITHM, rest))

    def _power_of_two(self, x: str) -> str:
        """2^x to 1e-4, from the whole part as an exponent and a polynomial of the rest."""
        code = self.code
        whole = code(f"call {code.vector} @llvm.floor.{code.suffix}({code.vector} {x})")
        rest = self._polynomial(POWER, self._minus(x, whole))
        bits = code(f"fptosi {code.vector} {whole} to {code.whole}")
        bias, shift = code.everywhere("1023", "i64"), code.everywhere("52", "i64")
        bits = code(f"add {code.whole} {bits}, {bias}")
        bits = code(f"shl {code.whole} {bits}, {shift}")
        return self._times(rest, code(f"bitcast {code.whole} {bits} to {code.vector}"))

    def _polynomial(self, coefficients: tuple[float, ...], x: str) -> str:
        total = self.code.number(coefficients[-1])
        for c in coefficients[-2::-1]:
            total = self.code.fma(total, x, self.code.number(c))
        return total

    def _at(self, name: str, h: str) -> str:
        """A component's series at a time from the beginning of the step, by Horner's rule."""
        code, place = self.code, self.component[name]
        total = code.element(place, self.order)
        for k in range(self.order - 1, -1, -1):
            total = code.fma(total, h, code.element(place, k))
        return total

    def _note_if_zero_is_possible(self, first: str, h: str, after: str) -> None:
        """Note the lanes on whose step M3 changes its sign or may touch zero."""
        code, M3 = self.code, self.component["M3"]
        sizes = [code.size(code.element(M3, k)) for k in range(self.order + 1)]
        reach, bend = sizes[-1], self._times(sizes[-1], code.number(float(self.order)))
        for k in range(self.order - 1, 0, -1):
            reach = code.fma(reach, h, sizes[k])
            if k > 1:
                bend = code.fma(bend, h, self._times(sizes[k], code.number(float(k))))
        far = code.compare("ogt", sizes[0], code.fma(reach, h, self.depth))
        steady = code.compare("ogt", sizes[1], self._times(bend, h))
        zero = "zeroinitializer"
        begin, end = (code.compare("olt", x, zero) for x in (code.element(M3, 0), after))
        changed = code.logic("xor", begin, end)
        silent = code.logic("or", far, steady)
        every = code.everywhere("true", "i1")
        noted = code.logic("or", changed, code.logic("xor", silent, every))
        mask = code(f"bitcast {code.mask} {noted} to i{LANES}")
        some = code(f"icmp ne i{LANES} {mask}, 0")
        with code.when(some):
            self._note(first, mask, (h, after, code.one_where(steady), *self._zero(h, after)))

    def _zero(self, h: str, after: str) -> tuple[str, ...]:
        """Time from the beginning to the zero of M3, the last correction, and Qp, Qm there."""
        code, M3 = self.code, self.component["M3"]
        before = code.element(M3, 0)
        x = self._times(h, code.binary("fdiv", before, self._minus(before, after)))
        for _ in range(NEWTON):
            value, slope = self._value_and_slope(M3, x)
            correction = code.binary("fdiv", value, slope)
            x = self._minus(x, correction)
        return x, correction, *(self._at(name, x) for name in COMPONENTS[:2])

    def _value_and_slope(self, place: str, x: str) -> tuple[str, str]:
        """A series and its derivative by Horner's rule."""
        code = self.code
        value, slope = code.element(place, self.order), code.number(0.0)
        for k in range(self.order - 1, -1, -1):
            slope = code.fma(slope, x, value)
            value = code.fma(value, x, code.element(place, k))
        return value, slope

    def _note(self, first: str, mask: str, fields: tuple[str, ...]) -> None:
        """Write down the lanes of a mask, with what is told of each."""
        code = self.code
        time = code.binary("fadd", *(code.load(x) for x in self.time))
        told = code.variable(f"[{len(FIELDS)} x {code.vector}]")
        for i, value in enumerate((time, *fields), start=1):
            code.store(value, code.at(told, i))
        with code.loop(LANES) as lane:
            bit = code(f"trunc i64 {lane} to i{LANES}")
            bit = code(f"lshr i{LANES} {mask}, {bit}")
            with code.when(code(f"trunc i{LANES} {bit} to i1")):
                self._note_lane(first, lane, told)

    def _note_lane(self, first: str, lane: str, told: str) -> None:
        code, width = self.code, width_of_note(self.order)
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
            row = code(f"sub i64 {i}, {shift}")
            row = code(f"mul i64 {row}, {LANES}")
            place = code.at(vectors, code(f"add i64 {row}, {lane}"), "double")
            code.store(code.load(place, "double", 8), code.at(to, i, "double"), "double", 8)

    def _let_time_pass(self, h: str) -> None:
        """Add the step to the time, with what the sum's rounding leaves over."""
        code = self.code
        high, low = (code.load(x) for x in self.time)
        total = code.binary("fadd", high, h)
        part = self._minus(total, high)
        lost = code.binary(
            "fadd", self._minus(high, self._minus(total, part)), self._minus(h, part)
        )
        code.store(total, self.time[0])
        code.store(code.binary("fadd", low, lost), self.time[1])
