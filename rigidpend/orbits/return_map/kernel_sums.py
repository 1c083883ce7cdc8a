"""Sums of a map's tables and polynomials in lanes: parts of the kernel's text."""

from rigidpend.orbits.integrate.kernel.lane_functions import Functions
from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS, Doubles, Value
from rigidpend.orbits.integrate.kernel.machine_code import Writer
from rigidpend.orbits.return_map.program import FUNCTIONS


class Sums:
    """Writer of sums over the coefficients of a program; their memory is the argument `%room`.

    Small terms are summed in doubles, `plain`, in the same memory as the program's own numbers,
    `numbers`: when a double is stored the further parts are set to zero, so that a sum goes on in
    the program's own numbers where the doubles have ended.
    """

    def __init__(self, bits: int) -> None:
        self.code = Writer()
        self.numbers = KINDS[bits](self.code)
        self.parts = self.numbers.parts
        self.plain = KINDS[53](self.code, self.parts)
        self.functions = Functions(self.numbers)

    def make_room(self) -> None:
        """Divide the room: tables at an orbit's energy, polynomials of the energy, harmonics.

        Running sums and places are variables of their own.
        """
        code, one = self.code, self.numbers.rows(self.parts)
        self.of_energy = code.at("%room", "%vectors")
        self.waves = code.at(self.of_energy, code.mul("%energies", self.parts))
        self.totals = [code.variable(one) for _ in range(FUNCTIONS)]
        self.sums_of_row = [code.variable(one) for _ in range(FUNCTIONS)]
        # Sines in doubles are added apart from cosines: additions wait less for one another.
        self.sines = [code.variable(one) for _ in range(FUNCTIONS)]
        self.bases = [code.variable(code.vector) for _ in range(FUNCTIONS)]
        self.polynomials = [code.variable(one) for _ in range(2)]
        self.place, self.value = code.variable("i64"), code.variable("i64")

    def tables_at(self, energy: Value) -> None:
        """Sum the tables over the Chebyshev polynomials of the energy, -1 to 1."""
        code, n = self.code, self.numbers
        # The polynomials themselves, by T_l = 2 e T_(l-1) - T_(l-2).
        n.store(self.number(1.0), self.of_energy, 0)
        with code.when(code("icmp sgt i64 %energies, 1")):
            n.store(energy, self.of_energy, 1)
        twice = n.plus(energy, energy)
        with code.loop("%energies", 2) as l:
            before, last = (n.load(self.of_energy, code(f"sub i64 {l}, {j}")) for j in (2, 1))
            n.store(n.minus(n.times(twice, last), before), self.of_energy, l)
        for place in (self.value, self.place):
            code.store("0", place, "i64", 8)
        with code.loop("%triples") as t:
            length, sharp, whole = self._integers("%lengths", t, 3)
            plain = code(f"sub i64 {length}, {sharp}")
            self._clear(self.totals)
            # The highest polynomial comes first, the small terms before the large ones.
            self._over_energies(self.plain, length, "0", plain)
            in_doubles = code(f"icmp eq i64 {whole}, 0")
            with code.when(in_doubles):
                self._keep([self.plain.load(total, 0) for total in self.totals])
            with code.when(code(f"xor i1 {in_doubles}, true")):
                self._set_bases(t)
                self._raise(n, self.totals)
                self._over_energies(n, length, plain, length)
                self._keep(self._lowered(n, self.totals))

    def _over_energies(self, n: Doubles, length: str, start: str, end: str) -> None:
        """Continue a triple's sums over polynomials of the energy with terms `start` to `end`."""
        code = self.code
        with code.loop(end, start) as l:
            # The l-th term belongs to the polynomial of order length - 1 - l.
            polynomial = n.load(self.of_energy, code.add(code(f"sub i64 {length}, {l}"), -1))
            at = code.load(self.value, "i64", 8)
            for j, total in enumerate(self.totals):
                self._add(n, total, self._scalar(n, code.add(at, j)), polynomial)
            code.store(code.add(at, FUNCTIONS), self.value, "i64", 8)

    def table(self, entries: list[str], x: Value, phase: Value) -> list[Value]:
        """The three functions of a table: sums of rows of harmonics times Chebyshev polynomials."""
        code, n = self.code, self.numbers
        rows, own, triple, first, listed, most, most_own = entries
        self._make_waves(phase, most, most_own)
        code.store(first, self.place, "i64", 8)
        self._set_bases(triple)
        older, last = self.polynomials
        n.store(self.number(1.0), older, 0)
        n.store(x, last, 0)
        # Rows in the program's own numbers come first here: their polynomials are recurred in these
        # numbers, and go on in doubles from there.
        self._clear(self.totals)
        self._raise(n, self.totals)
        self._rows(n, listed, x, "1", own)
        sharp = [n.load(total, 0) for total in self.totals]
        self._clear(self.totals)
        self._rows(self.plain, listed, x, own, rows)
        # Row 0, with the constants, is the largest and comes last.
        row = self._row(n, listed, "0")
        for total, found, value in zip(self.totals, sharp, row, strict=True):
            plain = n.of_double(self.plain.load(total, 0)[0])
            n.store(n.with_raised(n.with_raised(found, plain), value), total, 0)
        return self._lowered(n, self.totals)

    def _rows(self, n: Doubles, listed: str, x: Value, start: str, end: str) -> None:
        """Continue a table's sums with the rows `start` to `end`, each times its polynomial of x.

        The polynomials and the place among the coefficients go on from one call to the next.
        """
        code = self.code
        older, last = self.polynomials
        twice = n.plus(x, x)
        with code.loop(end, start) as i:
            polynomial = n.load(last, 0)
            for total, value in zip(self.totals, self._row(n, listed, i), strict=True):
                self._add(n, total, value, polynomial)
            n.store(n.minus(n.times(twice, polynomial), n.load(older, 0)), last, 0)
            n.store(polynomial, older, 0)

    def _row(self, n: Doubles, listed: str, i: str) -> list[Value]:
        """The three functions of a row of a table: sums over harmonics, with the constants last."""
        count, sharp = self._integers("%harmonics", self.code.add(listed, i), 2)
        cosines = self.sums_of_row
        self._clear([*cosines, *self.sines])
        self._over_harmonics(self.plain, (cosines, self.sines), sharp, count)
        for total, sines in zip(cosines, self.sines, strict=True):
            both = self.plain.plus(self.plain.load(total, 0), self.plain.load(sines, 0))
            self.plain.store(both, total, 0)
        self._raise(n, cosines)
        self._over_harmonics(n, (cosines, cosines), "0", sharp)
        for total, constant in zip(cosines, self._triple(n), strict=True):
            n.store(n.with_raised(n.load(total, 0), constant), total, 0)
        return self._lowered(n, cosines)

    def _over_harmonics(
        self, n: Doubles, sums: tuple[list[str], list[str]], start: str, end: str
    ) -> None:
        """Continue sums over cosines and over sines with the harmonics `start` to `end`, from 0."""
        code = self.code
        with code.loop(end, start) as m:
            for k, totals in enumerate(sums):
                wave = n.load(self.waves, code.add(code.mul(m, 2), k))
                for total, c in zip(totals, self._triple(n), strict=True):
                    self._add(n, total, c, wave)

    def _make_waves(self, phase: Value, most: str, most_own: str) -> None:
        """Find cos, sin, cos 2, sin 2, ... of a phase: up to `most_own` in the program's numbers.

        Further harmonics, up to `most`, are found in doubles.
        """
        n = self.numbers
        first = self.functions.cos_sin(phase)
        for k, value in enumerate(first):
            n.store(value, self.waves, k)
        self._further_waves(n, first, "1", most_own)
        self._further_waves(self.plain, first, most_own, most)

    def _further_waves(self, n: Doubles, first: tuple[Value, Value], start: str, end: str) -> None:
        """Find harmonics `start` to `end`, counted from 0, each from the one before."""
        code, (cos, sin) = self.code, first
        with code.loop(end, start) as m:
            at = code.mul(m, 2)
            c, s = (n.load(self.waves, code(f"sub i64 {at}, {k}")) for k in (2, 1))
            # The addition theorems.
            next_ = (
                self._two_products(n, (c, cos), (n.opposite(s), sin)),
                self._two_products(n, (s, cos), (c, sin)),
            )
            for k, value in enumerate(next_):
                n.store(value, self.waves, code.add(at, k))

    def _two_products(self, n: Doubles, *factors: tuple[Value, Value]) -> Value:
        """A cosine or a sine as a sum of two products: upon a base, for it is 1 at most."""
        base = self.code.number(4.0)
        total = n.raised(self.code.number(0.0), base)
        for a, b in factors:
            total = n.with_raised_product(total, a, b)
        return n.lowered(total, base)

    def rates(self, entries: list[str], I: Value) -> list[Value]:
        """The three polynomials in I, by Horner's rule: 1/Lambda, the depth's rest and dt'/dpsi."""
        code, n = self.code, self.numbers
        count, plain, first = entries
        code.store(first, self.place, "i64", 8)
        for total, value in zip(self.totals, self._triple(n), strict=True):
            n.store(value, total, 0)
        self._horner(self.plain, I, "1", plain)
        self._horner(n, I, plain, count)
        return [n.load(total, 0) for total in self.totals]

    def _horner(self, n: Doubles, I: Value, start: str, end: str) -> None:
        """Continue Horner's rule with coefficients `start` to `end`, the highest power first."""
        with self.code.loop(end, start):
            for total, value in zip(self.totals, self._triple(n), strict=True):
                n.store(n.settled(n.with_product(value, n.load(total, 0), I)), total, 0)

    def _keep(self, triple: list[Value]) -> None:
        """Write a triple's coefficients at the orbits' energies; the place goes on."""
        code, parts = self.code, [part for value in triple for part in value]
        place = code.load(self.place, "i64", 8)
        for k, part in enumerate(parts):
            code.store(part, code.at("%room", code.add(place, k)))
        code.store(code.add(place, len(parts)), self.place, "i64", 8)

    def _triple(self, n: Doubles) -> list[Value]:
        """The next three coefficients at the orbits' energies; the place goes on."""
        code = self.code
        place = code.load(self.place, "i64", 8)
        code.store(code.add(place, FUNCTIONS * n.parts), self.place, "i64", 8)
        parts = [code.element("%room", code.add(place, k)) for k in range(FUNCTIONS * n.parts)]
        return [tuple(parts[k : k + n.parts]) for k in range(0, len(parts), n.parts)]

    def _integers(self, base: str, index: str, count: int) -> list[str]:
        """The integers in a row of an array of `count` columns."""
        first = self.code.mul(index, count)
        return [self.code.scalar(base, self.code.add(first, k), "i64") for k in range(count)]

    def _scalar(self, n: Doubles, index: str) -> Value:
        """A coefficient, the same in each lane; its parts are `%apart` from one another."""
        code = self.code
        places = [code.add(index, code.mul("%apart", part)) for part in range(n.parts)]
        return tuple(code.everywhere(code.scalar("%values", place)) for place in places)

    def _set_bases(self, triple: str) -> None:
        """Set the bases of the sums of a triple, and of its whole table."""
        code, first = self.code, self.code.mul(triple, FUNCTIONS)
        for j, base in enumerate(self.bases):
            code.store(code.everywhere(code.scalar("%bases", code.add(first, j))), base)

    def _clear(self, totals: list[str]) -> None:
        for total in totals:
            self.numbers.store(self.number(0.0), total, 0)

    def _raise(self, n: Doubles, totals: list[str]) -> None:
        """Raise three totals, so far in doubles, to their bases."""
        for total, base in zip(totals, self.bases, strict=True):
            n.store(n.raised(self.plain.load(total, 0)[0], self.code.load(base)), total, 0)

    def _add(self, n: Doubles, total: str, a: Value, b: Value) -> None:
        n.store(n.with_raised_product(n.load(total, 0), a, b), total, 0)

    def _lowered(self, n: Doubles, totals: list[str]) -> list[Value]:
        """The three totals without their bases."""
        pairs = zip(totals, self.bases, strict=True)
        return [n.lowered(n.load(total, 0), self.code.load(base)) for total, base in pairs]

    def number(self, x: float) -> Value:
        """A double as the program's own number, the same in each lane."""
        return self.numbers.of_double(self.code.number(x))
