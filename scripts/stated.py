"""Stated errors held against the truth: how large a share of each bound the true error is.

    .venv/bin/python -m scripts.stated [--cases COUNT] [--seed SEED]

For every error that a result states, some random cases are computed as a result has them, and once
more by a finer computation. Of the true error over the stated one the table in docs/measured.md
has the median and the largest: at most 1, and not far below. It takes some minutes.
"""

import argparse
import math
import re
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any, NamedTuple
from unittest import mock

import numpy as np

from rigidpend import Body, find_orbit, route_codes
from rigidpend.experiments.closed_orbits import ORBITS
from rigidpend.experiments.compare import ROUNDING
from rigidpend.experiments.precession.compute import uncertainty, unit_of
from rigidpend.machine.wording import Table
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.mechanics.floquet import periodic_orbit
from rigidpend.mechanics.free_body import exponent
from rigidpend.mechanics.in_space import turning_rate
from rigidpend.numbers import Array
from rigidpend.numbers.exact import context, exact, fraction
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map import MapError
from rigidpend.routes.herpolhode import RouteOrbit, follow, samples
from rigidpend.routes.problem import RouteProblem, rotation_period
from rigidpend.routes.start import Scales, start, states_exact
from rigidpend.routes.symbolic import sharp as sharp_module
from rigidpend.routes.symbolic.asymptotic import doubly_asymptotic, skeleton
from rigidpend.routes.symbolic.chain import NoOrbit, passages
from rigidpend.routes.symbolic.closed import actions, closed, closing, words
from rigidpend.routes.symbolic.levels import ChainLevel, orbits_of
from rigidpend.routes.symbolic.stretching import stretched
from rigidpend.surfaces import heteroclinic, splitting
from rigidpend.surfaces.surface_orbits import (
    J2_0,
    coefficients,
    lag,
    launch,
    meet,
    numbers,
    surface,
)
from scripts.readme_tables import ROOT, write_table
from scripts.stated_orbits import Once, alpha, multiplier

PAGE = ROOT / "docs" / "measured.md"
H0 = exact(1)
ARITHMETIC = resolve("taylor", 3e-14)
FINE = 212
"""Bits of a truth that is integrated."""
FIG4 = Body(A=(2, 1, "3/2"), r=(1, 1, 0), mu="0.001")
FIG5 = Body(A=(2, "3/2", "1.8"), r=(0, 1, 0), mu="0.01")
FIG5_ORBITS = RouteProblem(FIG5, exact("10/9"), exact("2.39205e-9"), 5)
H4 = exact("1.3342")
"""Energy of Fig. 4's orbits."""
Shares = Iterator[float]


class Stated(NamedTuple):
    """An error that results state, with the measurement of its shares."""

    what: str
    truth: str
    """The finer computation."""
    shares: Callable[[Any, int], Shares]
    """From a generator of random numbers and a count to true errors over stated ones."""
    cost: int = 1
    """Times as long as the quickest takes for a case: so many fewer cases are tried."""


def body(random: Any, least: float, most: float) -> Body:
    """A body with random moments and centre of gravity; mu is between powers of ten."""
    share, thick = random.uniform(0.55, 0.95), random.uniform(0.05, 0.95)
    A = (1, round(1 - share + thick * (2 * share - 1), 3), round(share, 3))
    turn, mu = random.uniform(0, math.pi / 2), 10 ** random.uniform(least, most)
    return Body(A, (round(math.cos(turn), 3), round(math.sin(turn), 3), 0), f"{mu:.3g}")


def of_splitting(random: Any, count: int) -> Shares:
    """The error of `excess`, in the precision that decided."""
    for _ in range(count):
        one = body(random, -4, -0.7)
        allowed = min(1e-9, 4e-3 * float(one.mu) ** 2)
        found = splitting.measure(one, H0, allowed, ARITHMETIC._replace(precisions=(53, 106)))
        finer = surface(one, H0, 106 if found.bits == 53 else FINE)
        with mock.patch.object(splitting, "FEWEST", 2 * found.n):
            only = ARITHMETIC._replace(precisions=(finer.bits,))
            truth = splitting.measure(one, H0, found.error / 1e3, only)
        if found.resolved and truth.resolved:
            # The truth is rounded to doubles too.
            off = np.abs(found.excess - truth.excess) - np.spacing(np.abs(truth.excess)) / 2
            yield max(0.0, float(off.max() / found.error))


def of_precession(random: Any, count: int) -> Shares:
    """The error of `gained`."""
    for _ in range(count):
        one = body(random, -4, -1)
        found = heteroclinic.increments(one, H0, ARITHMETIC)
        off = [
            abs(float(_gained(one, number, side) - found.gained[k, number - 1]))
            for number in (1, 2)
            for k, side in enumerate((1, -1))
        ]
        yield max(off) / float(uncertainty(found, unit_of(one, 1.0), one.nu, 1 - float(one.mu)))


def _gained(one: Body, number: int, side: int) -> Any:
    """theta3 along separatrix 1 or 2, in 106 bits, deeper and with thrice as many nodes."""
    s = surface(one, H0, 106, number)
    m, depth = numbers(106), 120
    goal = side * m.pi / 2
    phase, before, slope = goal - lag(s, m.mpf(depth)), None, m.mpf(1)
    while True:
        points = meet(s, [phase], m.mpf(depth), ARITHMETIC)
        assert points is not None
        gap = points.phase[0] - goal
        if abs(gap) < 1e-24:
            break
        slope = slope if before is None else (gap - before[1]) / (phase - before[0])
        before = phase, gap
        phase -= gap / slope
    rate = exponent(J2_0(s), s.p, m)
    step = 2 * m.pi / (rate * (3 * heteroclinic.STEPS + s.p.nu / m.pi))
    times = [points.time[0] - k * step for k in range(int(points.time[0] / step))][::-1]
    rates = []
    start_at = np.array(launch(s, phase, m.mpf(depth)), dtype=object)[:, None]
    states = states_at(coefficients(s), start_at, [fraction(t, 106) for t in times], 106)
    for state in states[..., 0].T:
        Qp, Qm, M3, *_ = (m.mpf(x.numerator) / x.denominator for x in state)
        M = (Qp + Qm) / (2 * m.cos(s.p.alpha0 / 2)), (Qp - Qm) / (2 * m.sin(s.p.alpha0 / 2)), M3
        r = m.cos(s.p.beta0 / 2), m.sin(s.p.beta0 / 2), 0
        rates.append(turning_rate(M, r, s.p.mu))
    sense = {1: -1, 2: 1}[number]
    return sense * step * (2 * sum(rates) - rates[-1])


def of_exponents(random: Any, count: int) -> Shares:
    """The rounding of ln of the growth of a deviation."""
    for _ in range(count):
        one, n = body(random, -6.5, -1.7), int(random.integers(1, 7))
        theta2, J1 = random.uniform(0, 2 * math.pi), 10 ** random.uniform(-9, -6)
        try:
            orbits = orbits_of(RouteProblem(one, H0, exact("1e-8"), n))
        except MapError:
            continue
        found = stretched(orbits, np.array([theta2]), np.array([J1]), n)
        problem = RouteProblem(one, H0, exact(J1), n)
        routes = route_codes(
            one, [theta2], h0=H0, J1_0=exact(J1), n_symbols=n, precisions=(106, 160)
        )
        if found.inside[0] and (routes.codes == found.symbols).all():
            truth = _growth(problem, theta2, routes.crossing_time[[0, -1], 0])
            yield abs(float(truth - found.growth[-1, 0])) / float(found.allowed[0])


def _growth(problem: RouteProblem, theta2: float, crossing_time: Array) -> Any:
    """ln of the growth from the first crossing to the last: orbits 2^-70 beside, in 212 bits."""
    m, begin = context(FINE), start(problem, FINE, Scales())
    c = begin.coefficients
    [state] = states_exact(begin, [exact(theta2)], FINE).T
    (begun, here), (ended, there) = (
        _crossing(c, state, Fraction(float(time))) for time in crossing_time
    )
    p, k = problem.body.angles(FINE), AlignedCoefficients(*map(_number, c))
    wide, tall = 1 / (2 * m.cos(p.alpha0 / 2)), 1 / (2 * m.sin(p.alpha0 / 2))

    def upright(x: Any) -> Any:
        """(M', gamma) in principal axes, of components or changes of them."""
        Qp, Qm, *others = map(_number, x)
        return np.array([(Qp + Qm) * wide, (Qp - Qm) * tall, *others])

    at = upright(here)
    M, gamma = at[:3], at[3:]
    rises = [k.kappa * x for x in M]
    rises[0] -= M[0] / (4 * wide**2)
    rises[1] += M[1] / (4 * tall**2)
    kept = [[0, 0, 1, 0, 0, 0], [*rises, k.mu_r1, k.mu_r2, 0], [*gamma, *M], [0, 0, 0, *gamma]]
    basis = _orthonormal([*kept, *np.eye(6, dtype=int).tolist()], m)[4:6]
    apart, beside = m.mpf(2) ** -70, []
    for along in basis:
        M1, M2, *others = along
        off = [(M1 / wide + M2 / tall) / 2, (M1 / wide - M2 / tall) / 2, *others]
        for side in (1, -1):
            moved = [_number(x) + side * apart * y for x, y in zip(here, off, strict=True)]
            beside.append([fraction(x, FINE) for x in moved])
    time = np.array([fraction(_number(ended - begun), FINE)], dtype=object)
    ends = states_at(c, np.array(beside, dtype=object).T, time, FINE)[:, 0].T
    flow = upright(aligned(there, c))
    columns = []
    for ahead, back in (ends[:2], ends[2:]):
        change = (upright(ahead) - upright(back)) / (2 * apart)
        columns.append(change - flow * (change[2] / flow[2]))
    one, other = columns
    sizes = one @ one, other @ other
    both = m.sqrt((sizes[0] - sizes[1]) ** 2 + 4 * (one @ other) ** 2)
    return m.log((sum(sizes) + both) / 2) / 2


def _crossing(c: AlignedCoefficients, state: Any, time: Fraction) -> tuple[Fraction, Any]:
    """The crossing of M3 = 0 next to a time."""
    while True:
        at = states_at(c, np.array(state, dtype=object)[:, None], [time], FINE)[:, 0, 0]
        late = -at[2] / aligned(at, c)[2]
        if abs(late) < Fraction(1, 2**170):
            return time, at
        time = fraction(_number(time + late), FINE)


def _number(x: Any) -> Any:
    m = context(FINE)
    return m.mpf(x.numerator) / x.denominator if isinstance(x, Fraction) else m.mpf(x)


def _orthonormal(rows: Any, m: Any) -> list[Any]:
    """Gram and Schmidt's basis; rows that lie in the space of those before are left out."""
    found: list[Any] = []
    for row in rows:
        left = np.array([m.mpf(x) for x in row])
        for _ in range(2):
            for unit in found:
                left = left - (left @ unit) * unit
        if left @ left > 0.05:
            found.append(left / m.sqrt(left @ left))
    return found


def _closed(random: Any, count: int, bits: int = 113) -> Iterator[Any]:
    """Closed orbits of random words of random bodies, refined in so many bits."""
    known = list(words(4))
    for _ in range(count):
        one = body(random, -3.5, -2)
        try:
            orbit = closed(ChainLevel.of(one, H0), known[random.integers(len(known))])
            yield orbit, closing(orbit, bits)
        except (MapError, NoOrbit):
            continue


def of_periods(random: Any, count: int) -> Shares:
    """The error of a passage's time, for the period: `alone`, `passage_error`."""
    for orbit, fine in _closed(random, count):
        stated = passages(orbit.chain)[1].sum()
        yield abs(float(fine.period - Fraction(orbit.period))) / float(stated)


def of_closing(random: Any, count: int) -> Shares:
    """The gap that a closed orbit is expected to leave after a period."""
    for _, fine in _closed(random, count):
        yield fine.error / fine.expected


def of_found(random: Any, count: int) -> Shares:
    """Half a unit of the last digit of a found orbit's theta2_0."""
    for _ in range(count):
        digits = int(random.integers(12, 40))
        code = random.integers(0, 2, int(random.integers(1, 6)))
        given: dict[str, Any] = {"h0": "1.3342", "J1_0": "1e-8"}
        told, truth = (
            find_orbit(FIG4, code, digits=n, **given).theta2_0 for n in (digits, digits + 15)
        )
        yield abs(float(told - truth)) * 2 * 10.0**digits


def of_asymptotic(random: Any, count: int) -> Shares:
    """A unit of the 30th digit of a doubly asymptotic orbit's theta2_0."""
    level = ChainLevel.of(FIG4, "1.3342")
    rough = [one for one, _ in skeleton(level, 2, 9) if len(one.b)]
    told = [_sharp(level, one) for one in rough]
    finer: dict[str, Any] = {
        "PAIRS": FINE,
        "BITS": FINE + 40,
        "DEPTH": Fraction(1, 10**26),
        "HIGHEST": Fraction(1, 10**32),
        "FINEST": 1e-38,
        "NEAREST": 1e-14,
    }
    with mock.patch.multiple(sharp_module, **finer):
        truth = [_sharp(level, one) for one in rough]
    off = [
        abs(float(x - y))
        for a, b in zip(told, truth, strict=True)
        for x, y in zip(a, b, strict=True)
    ]
    yield from [x / 1e-29 for x in off][:count]


def _sharp(level: ChainLevel, rough: Any) -> list[Fraction]:
    orbits = doubly_asymptotic(level, rough)
    return sharp_module.sharp(sharp_module.Launch(level, exact("1e-8")), orbits).theta2_0


def _followed(random: Any, count: int) -> Iterator[tuple[float, RouteOrbit, Array]]:
    """Orbits of Fig. 5 at random phases, with the times of their crossings in 106 bits."""
    given: dict[str, Any] = {"h0": FIG5_ORBITS.h0, "J1_0": FIG5_ORBITS.J1_0, "n_symbols": 5}
    for _ in range(count):
        theta2 = float(random.uniform(0, 2 * math.pi))
        told = route_codes(FIG5, [theta2], precisions=(106, 160), **given).crossing_time[:, 0]
        orbit = follow(
            FIG5_ORBITS, theta2, told, step=rotation_period(FIG5_ORBITS) / 60, engine="taylor",
            tolerance=ARITHMETIC.tolerance,
        )  # fmt: skip
        yield theta2, orbit, told


def of_herpolhodes(random: Any, count: int) -> Shares:
    """The delay of the samples of Fig. 5, as large as it becomes."""
    given: dict[str, Any] = {"h0": FIG5_ORBITS.h0, "J1_0": FIG5_ORBITS.J1_0, "n_symbols": 5}
    for theta2, orbit, told in _followed(random, count):
        fine = route_codes(FIG5, [theta2], precisions=(FINE, 424), **given)
        truth = fine.crossing_time[:, 0]
        late = np.abs(told + orbit.crossing_error - truth).max()
        # Both times, and the sum, are rounded to doubles.
        rounding = 1.5 * np.spacing(truth.max())
        yield float(late / (np.abs(orbit.crossing_error).max() + rounding))


def of_alpha(random: Any, count: int) -> Shares:
    """alpha at the last crossing, which its slope and the delay there are to explain."""
    for theta2, orbit, told in _followed(random, count):
        k, angle = int(np.searchsorted(orbit.t, told[-1])), samples(FIG5, *orbit[:2]).alpha
        slope = np.abs(np.diff(angle[k - 1 : k + 2])).max() / orbit.t[1]
        off = abs(alpha(FIG5_ORBITS, theta2, float(orbit.t[k])) - float(angle[k]))
        yield off / (slope * abs(float(orbit.crossing_error[-1])) + ROUNDING)


def of_actions(random: Any, count: int) -> Shares:
    """Actions of some of the words of the config, by what two results may differ."""
    level, allowed = ChainLevel.of(FIG4, H4), ORBITS["action"].within
    assert isinstance(allowed, float)
    known = list(words(8))
    for k in random.choice(len(known), count, replace=False):
        orbit = closed(level, known[k], 11)
        [action] = actions([orbit.chain])
        yield abs(action - Once(orbit, closing(orbit, FINE)).action()) / allowed


def of_closed(random: Any, count: int) -> Shares:
    """The exponent of a closed orbit."""
    for orbit, fine in _closed(random, count, FINE):
        yield abs(orbit.exponent - Once(orbit, fine).exponent()) / orbit.exponent_error


def of_multipliers(random: Any, count: int) -> Shares:
    """ln of a periodic orbit's multiplier and its period, up to where it is nearly at rest."""
    for _ in range(count):
        light, family = body(random, -4, -3), int(random.integers(1, 3))
        one = Body(light.A, light.r, f"{1 - 10 ** random.uniform(-7, -0.01):.9f}")
        try:
            found = periodic_orbit(one.angles(), 1.0, family)
        except ArithmeticError:
            # It is elliptic, or its steps do not settle, which is said.
            continue
        truth, period = multiplier(one, H0, family)
        rest = 1 - float(one.mu)
        steep = math.sin(one.alpha0)
        off = abs(float(abs(found.exponent_per_period) - truth)) * 2.0**45 * steep
        yield rest * max(off, abs(float(found.period / period - 1)) * 2.0**48)


STATED = (
    Stated("`splitting`: `error` of `excess`", "twice the orbits, 106 or 212 bits", of_splitting),
    Stated("`precession`: `error` of `gained`", "thrice the nodes, 106 bits", of_precession, 4),
    Stated("`exponents`: `allowed`", "orbits 2^-70 beside, 212 bits", of_exponents),
    Stated("`closed_orbits`: `alone` of a period", "all passages in 113 bits", of_periods),
    Stated("`closed_orbits`: `closing_expected`", "once round in 113 bits", of_closing),
    Stated("`closed_orbits`: `action`", "a period's quadrature, 212 bits", of_actions),
    Stated("`closed_orbits`: `exponent_error`", "orbits 2^-110 beside, 212 bits", of_closed),
    Stated(
        "`periodic_orbit`: multiplier, period", "orbits 2^-110 beside, 212 bits", of_multipliers
    ),
    Stated("`find`: the last digit of `theta2_0`", "15 digits more", of_found, 4),
    Stated("`asymptotic_orbits`: the 30th digit", "212 bits, 1e-10 deeper", of_asymptotic, 10),
    Stated("`herpolhodes`: `crossing_error`", "212 bits", of_herpolhodes, 2),
    Stated("`herpolhodes`: `alpha` by `crossing_error`", "113 bits in principal axes", of_alpha, 4),
)
"""Every stated error of the experiments that integrate orbits."""


def measured(stated: Stated, cases: int, seed: int) -> list[float]:
    """Shares of a stated error's bound, ascending, of the cases that have one."""
    random = np.random.default_rng([seed, *map(ord, stated.what)])
    return sorted(stated.shares(random, max(1, cases // stated.cost)))


def kept(text: str) -> dict[str, tuple[str, ...]]:
    """The rows of the page's table, by what is stated."""
    rows = re.findall(r"^\| (`.+) \|$", text.partition("<!-- stated -->")[2], re.MULTILINE)
    return {row.split(" | ")[0]: tuple(row.split(" | ")) for row in rows}


def main() -> None:
    """Measure all, or those that are asked for, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="a part of what is stated; others are kept")
    given = parser.parse_args()
    found = {}
    for stated in STATED:
        if given.only in stated.what:
            shares = measured(stated, given.cases, given.seed)
            sizes = f"{np.median(shares):.2g}", f"{shares[-1]:.2g}"
            found[stated.what] = (stated.what, stated.truth, str(len(shares)), *sizes)
            print(*found[stated.what], sep=" | ", flush=True)
    known = kept(PAGE.read_text(encoding="utf-8")) | found
    header = ("stated", "truth", "cases", "median", "largest")
    rows = [known[x.what] for x in STATED if x.what in known]
    write_table(PAGE, "stated", Table("True error over stated error", header, rows))


if __name__ == "__main__":
    main()
