"""The checkers of one orbit: every slip that they must notice, and that they share nothing."""

import ast
import math
import re
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flint import arb

from rigidpend import route_codes
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.states import states_at
from rigidpend.routes.certified import approximation, orbit
from rigidpend.routes.certified.codes import prove
from rigidpend.routes.certified.orbit import OrbitChecker, ProvenCrossing, enclosed, proof_of
from rigidpend.routes.certified.proof_data import Step
from rigidpend.routes.problem import RouteProblem
from scripts import check_certificate, check_full_shift, check_intervals, check_sections
from scripts.check_certificate import Fails, Interval, Refused
from tests.bodies import FIG4, problem
from tests.cli.calls import REFERENCE
from tests.routes.certified.offered import GIVEN, Start, interval, said, same_limit

PHASE = exact("3/10")
PROBLEM = problem(n_symbols=2)
BITS = 70
"""At the start: enough for three crossings of this orbit."""


@pytest.fixture(scope="module")
def steps() -> list[Step]:
    """A proof of two symbols."""
    found = prove(PROBLEM, PHASE, BITS)
    assert found.reason == ""
    return found.steps


def test_the_checker_finds_again_what_was_proven(steps: list[Step]) -> None:
    again = proof_of(PROBLEM, PHASE, steps)
    assert again.reason == ""
    assert [c.separatrix for c in again.crossings] == [2, 1, 2]
    assert all(c.radius < 1e-3 and c.bound < 2**-6 for c in again.crossings)
    # Those of doubles, of which the third errs by some 1e-7.
    found = route_codes(FIG4, "3/10", h0="1.3342", J1_0="1e-8", n_symbols=2, precisions=(53,))
    assert [c.time for c in again.crossings] == pytest.approx(found.crossing_time[:, 0], abs=1e-6)
    less = proof_of(PROBLEM, PHASE, steps[:-1])
    assert less.reason == "the steps end before the last crossing"
    assert len(less.crossings) == 2
    # What the steps prove beyond the symbols that are asked for is left out.
    assert proof_of(problem(n_symbols=1), PHASE, steps).crossings == again.crossings[:2]


@pytest.mark.slow
def test_both_checkers_find_the_same_bounds_and_crossings(steps: list[Step]) -> None:
    Interval.digits = 2 * steps[0].bits + 256
    walk = check_certificate.Walk(check_certificate.problem_of(Start()._asdict(), Fraction(3, 10)))
    checker = OrbitChecker(enclosed(PROBLEM, PHASE, steps[0].bits + 64))
    for step in steps:
        checker.take(step)
        walk.take(check_certificate.Step(*step))
        # Bounds of their own, by other means; rounding alone would be far less.
        assert 0.9 < float(walk.bound.above) / float(checker.bound) < 1.1
    assert walk.separatrices == [c.separatrix for c in checker.crossings] == [2, 1, 2]


@pytest.mark.parametrize("component", range(6))
@pytest.mark.parametrize("j", [0, 7])
def test_a_changed_coefficient_raises_the_bound(steps: list[Step], component: int, j: int) -> None:
    def bound(*given: Step) -> float:
        checker = OrbitChecker(enclosed(PROBLEM, PHASE, given[0].bits + 64))
        for step in given:
            checker.take(step)
        return float(checker.bound)

    *first, last = steps[:4]
    series = [list(row) for row in last.series]
    series[component][j] += 1 << last.bits - 30
    assert bound(*first, last._replace(series=series)) > 100 * bound(*first, last)


# ---- Hypotheses, each up to where both checkers refuse.


def step_of(start: Start, away: float, half: float) -> tuple[Start, Step]:
    """A step along the orbit that starts so far from the true one, in Qm."""
    orbit = start.approximation(60, Qm=away)
    orbit.longest = 2 * half
    return start, orbit.step(60)


def joint(off: float) -> tuple[Start, Step]:
    """H1: the first polynomial begins so far from the orbit."""
    return step_of(Start(), off, 2.0**-12)


def flaw(off: float) -> tuple[Start, Step]:
    """H2: c (T_2 - 1) vanishes at both ends, and its derivative does not."""
    start, step = step_of(Start(), 0.0, 2.0**-12)
    series = [list(row) for row in step.series]
    c = round(off * 2**step.bits)
    series[0][2] += c
    series[0][0] -= 2 * c
    return start, step._replace(series=series)


def tube(off: float) -> tuple[Start, Step]:
    """H3: what the distance grows to over half a unit of time."""
    return step_of(Start(), off, 0.25)


def sign(off: float) -> tuple[Start, Step]:
    """H4: M3 = 2 J1 - J2 at the start, and hardly changed by the end of a short step."""
    return step_of(Start(J1_0="7/10"), off, 2.0**-16)


def slope(off: float) -> tuple[Start, Step]:
    """H5: M3 rises through zero at the rate Qp^2/(4 lambda), and Qm is small."""
    A3, h0, half = 1.0117, 1.09, 0.45
    kappa, s2 = 2 / A3, 2 * (A3 - 1) / A3
    J2 = math.sqrt(2 * h0 / kappa)
    J1 = (J2 - half * J2**2 * math.sqrt(s2 * (1 - s2))) / 2
    return step_of(Start(("2", "1", str(A3)), GIVEN["r"], "1e-9", str(h0), repr(J1)), off, half)


@pytest.mark.parametrize(
    ("name", "made", "barely"),
    [
        ("H1", joint, 0.0005),
        ("H2", flaw, 0.0005),
        ("H3", tube, 0.0005),
        ("H4", sign, 0.005),
        # A checker's parts are too coarse for less.
        ("H5", slope, 0.02),
    ],
)
def test_what_is_barely_true_passes_and_what_is_barely_false_is_named(
    name: str, made: Callable[[float], Any], barely: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first three show in the package's tube, as far off; also of an interval of starts."""
    # Steps may end where the prover would not end them.
    monkeypatch.setattr(approximation, "CLEAR", 0.0)

    def of_orbit(off: float) -> Any:
        start, step = made(off)
        return start.checks([step])

    def of_interval(off: float) -> Any:
        start, step = made(off)
        return start.checks_of_interval([step])

    # Beyond that H1 is asked first.
    most = 0.1 if name in ("H1", "H2") else 0.0155
    if made in (joint, flaw, tube):
        limit = same_limit(f"{name}: ", 1e-4, most, lambda off: of_orbit(off)[1:], barely)
        own = same_limit("H3: ", 1e-4, 0.1, lambda off: of_orbit(off)[:1], barely)
        assert own == pytest.approx(limit, rel=2 * barely)
        wide = same_limit("H3: ", 1e-4, 0.1, of_interval, barely)
        assert wide == pytest.approx(limit, rel=4 * barely)
    else:
        limit = same_limit(f"{name}: ", 1e-4, most, of_orbit, barely)
    assert [said(check) for check in of_orbit(limit / 2)] == [""] * 2


def of_state(
    half: float, off: float, state: Callable[[float, Any], Sequence[float]]
) -> list[Callable[[], Any]]:
    """A step by both of a heavy body from a state, a function of how far off it is and the body."""
    start = Start(mu="1")
    mine, given = enclosed(start.problem, PHASE, 200), start._asdict()
    theirs = check_certificate.problem_of(given, Fraction(3, 10))
    c = AlignedCoefficients(*(float(x.mid()) for x in mine.numbers.field))
    true, beside = state(0.0, c), state(off, c)
    numbers: Any = Fraction
    own = OrbitChecker(mine._replace(state=tuple(map(arb, true))))
    other = check_certificate.Walk(theirs._replace(start=tuple(map(numbers, true))))
    orbit = approximation.Approximation(mine.numbers.field, list(map(arb, beside)))
    orbit.longest = 2 * half
    step = orbit.step(60)

    def by_package() -> list[ProvenCrossing]:
        own.take(step)
        return own.crossings

    return [by_package, lambda: other.take(check_certificate.Step(*step))]


@pytest.mark.parametrize("rising", [True, False])
def test_H5_the_large_Q_beside_its_bound(rising: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """M3 passes zero by the weight's torque, by which Q changes too; a step begins 1e-3 off."""
    monkeypatch.setattr(approximation, "CLEAR", 0.0)
    half = 2.0**-6

    def both(Q: float) -> list[Callable[[], Any]]:
        def state(off: float, c: Any) -> Sequence[float]:
            Qs = (Q, off) if rising else (off, Q)
            M3 = (-1 if rising else 1) * c.mu_r2 * half
            return *Qs, M3, float(rising), float(not rising), 0.05

        return of_state(half, 1e-3, state)

    same_limit("H5: Q is too near", 0.1, 1e-4, both)


def passing(half: float, rate: float, component: int) -> Callable[[float, Any], Sequence[float]]:
    """States half a step before one with M3 = 0 and that rate of M3: Qp and the weight turn it."""

    def state(off: float, c: Any) -> Sequence[float]:
        gamma1 = (rate - c.twist * 0.25) / c.mu_r2
        middle = np.array([0.5, 0.0, 0.0, gamma1, 0.0, math.sqrt(1 - gamma1**2)])
        begin = states_at(c, middle, [0.0, -half])[:, -1]
        return (begin + off * np.eye(6)[component]).tolist()

    return state


def rising(M3: float) -> Callable[[float, Any], Sequence[float]]:
    """States from which M3 rises by the weight's torque alone, to zero in that time."""
    return lambda off, c: (0.1, off, -M3 * c.mu_r2, 1.0, 0.0, 0.05)


@pytest.mark.parametrize(
    ("half", "off", "state", "told"),
    [
        *((2.0**-6, 1e-4, rising(M3), "at an end") for M3 in (0.0, 2.0**-5)),
        # In the middle the torques of Qp and of the weight cancel: it has no rate there.
        (2.0**-3, 1e-6, passing(2.0**-3, 0.0, 0), "too near zero without crossing it"),
    ],
)
def test_H4_M3_is_told_at_both_ends_of_a_step_and_does_not_touch_zero(
    half: float, off: float, state: Any, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(approximation, "CLEAR", 0.0)
    for of_one in of_state(half, off, state):
        assert re.match(f"H4: .* {told}", said(of_one))


@pytest.mark.parametrize(("off", "widest"), [(3e-3, 1.4), (-1e-3, 1.5)])
def test_H5_a_time_may_be_off_by_as_much_as_M3_over_its_least_rate(
    off: float, widest: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rate is 0.1 where the orbit crosses, and another where the polynomials do."""
    monkeypatch.setattr(approximation, "CLEAR", 0.0)
    half = 2.0**-4
    [true], [found] = (of_state(half, x, passing(half, 0.1, 2))[0]() for x in (0.0, off))
    apart = abs(found.time - true.time)
    assert true.radius < 1e-12
    assert apart <= found.radius < widest * apart


def test_a_step_goes_forward_along_an_orbit_and_along_those_of_an_interval() -> None:
    start, step = joint(0.0)
    # Backward along the same orbits: all but the direction is as it should be.
    mirrored = [[w * (-1) ** j for j, w in enumerate(row)] for row in step.series]
    back = Step(-step.half_length, step.bits, mirrored)
    for steps, forward in (
        ([step], True),
        ([step._replace(half_length=0)], False),
        ([step, back], False),
    ):
        for of_one in (*start.checks(steps), *start.checks_of_interval(steps)):
            assert ("H2: the length of a step" in said(of_one)) is not forward


def test_a_problem_in_units_beyond_doubles_is_the_same() -> None:
    Interval.digits = 512
    given = Start()._asdict()
    units = {"mu": "4**1200", "h0": "4**1200", "J1_0": "2**1200"}
    large = given | {name: f"({given[name]})*{by}" for name, by in units.items()}
    both = [check_certificate.problem_of(x, Fraction(1)) for x in (given, large)]
    for a, b in zip(*((x.a, *x.mu, *x.start) for x in both), strict=True):
        assert max(a.low, b.low) <= min(a.high, b.high) < max(a.low, b.low) + 2**20


def test_bounds_beyond_doubles_are_refused_by_name() -> None:
    Interval.digits = 512
    problem = check_certificate.problem_of(Start()._asdict(), Fraction(1))
    series = [[1 << 1200]] * 6
    with pytest.raises(Fails, match=r"H1: more than 1e\+06 where two steps join"):
        check_certificate.Walk(problem).take(check_certificate.Step(1, 1, series))
    # A step so long that its growth has no number either: half of it is 2^20.
    still = check_certificate.Step(1 << 52, 60, [[0]] * 6)
    M3 = check_certificate.on_parts(still.series[2], still.bits, 32)
    with pytest.raises(Fails, match=r"H3: a bound that grows by more than exp\(512\)"):
        check_certificate.Walk(problem).tube(still, Fraction(1, 2**60), M3, 32)


# ---- The second checker shares nothing with the package, and has the same problem.

SCRIPTS = sorted(Path(check_certificate.__file__).parent.glob("check_*.py"))
ALLOWED = {"__future__", "argparse", "ast", "collections", "concurrent", "decimal", "fractions"}
ALLOWED |= {"functools", "itertools", "json", "math", "pathlib", "re", "sys", "typing"}
ALLOWED |= {"h5py", "yaml", ""}


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda file: file.stem)
def test_it_imports_nothing_of_the_package(script: Path) -> None:
    found = set()
    for node in ast.walk(ast.parse(script.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert not node.level
            module = node.module or ""
            found.add("" if module.startswith("scripts.check_") else module.partition(".")[0])
        # Nor does it call what imports by a name.
        assert not (isinstance(node, ast.Name) and node.id in ("__import__", "exec", "eval"))
    assert found <= ALLOWED


@pytest.mark.parametrize("text", [b"- 1", b"a: [", b"experiment: route_codes", b"", b"\xff"])
def test_a_second_config_that_is_none_is_refused_in_a_sentence(
    text: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (given := tmp_path / "given.yaml").write_bytes(text)
    with pytest.raises(Refused, match=r"given\.yaml is no config of"):
        check_certificate.stated_by(given)
    for script, name in ((check_full_shift, "full_shift"), (check_intervals, "fig4_intervals")):
        file = REFERENCE / f"{name}.h5"
        assert script.main([str(file), "--config", str(given)]) == 1
        assert f"{file}: not proven: {given} is no config" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("A", "r", "mu", "h0", "J1_0", "theta2_0"),
    [
        (("2", "1", "3/2"), ("1", "1", "0"), "1/1000", "1.3342", "1e-8", "3*pi/40 + 1/100"),
        (("2", "3/2", "9/5"), ("0", "1", "0"), "1/100", "10/9", "2.39205e-9", "1.02"),
        (("4", "sqrt(2)", "3"), ("1", "2", "0"), "1e-3", "40", "tan(1)", "-atan(7)"),
        # J2_0 = 1/2 exactly, a power of two.
        (("2", "1", "3/2"), ("3", "4", "0"), "1/1000", "1/6", "1/8", "-100"),
        # An interval of 0 reaches below it.
        (("2", "1", "3/2"), ("cos(pi/2)", "1", "0"), "1/1000", "1.3342", "1e-8", "1"),
    ],
)
def test_the_problem_is_enclosed_as_in_the_package(
    A: tuple[str, ...], r: tuple[str, ...], mu: str, h0: str, J1_0: str, theta2_0: str
) -> None:
    """In balls that are narrow, and have a number in common."""
    Interval.digits = 128
    given = {"A": A, "r": r, "mu": mu, "h0": h0, "J1_0": J1_0}
    other = check_certificate.problem_of(given, check_certificate.number(theta2_0))
    of = RouteProblem(Body(A=A, r=r, mu=mu), exact(h0), exact(J1_0), 1)
    found = enclosed(of, exact(theta2_0), 128)
    fourth, rest = found.numbers.field[:4], found.numbers.field[4:]
    pairs: list[Sequence[Any]] = [
        *zip(fourth, [other.lam, other.a, other.b, other.twist], strict=False),
        *zip(rest, (*other.mu, *other.omega), strict=True),
        *zip(found.state, other.start, strict=True),
    ]
    for ball, theirs in pairs:
        mine = interval(ball)
        assert max(x.high - x.low for x in (mine, theirs)) < 1 << 28
        assert mine.low <= theirs.high
        assert theirs.low <= mine.high


@pytest.mark.parametrize("r", [("-1e-9", "1", "0"), ("1", "-sqrt(2)", "0"), ("1", "1", "1e-9")])
def test_a_body_that_the_pages_are_not_about_is_refused(r: tuple[str, ...]) -> None:
    given = {"A": ("2", "1", "3/2"), "r": r, "mu": "1/1000", "h0": "1", "J1_0": "1e-8"}
    for problem_of in (
        lambda: check_certificate.problem_of(given, Fraction(0)),
        lambda: check_sections.problem_of(given),
    ):
        with pytest.raises(Refused, match="r1, r2 >= 0 = r3 is broken"):
            problem_of()
    # Else starts with theta2_0 + pi would be called those with theta2_0.
    check_sections.problem_of({**GIVEN, "mu": "0"})
    with pytest.raises(Refused, match="A or r is not three numbers"):
        check_sections.problem_of({**GIVEN, "A": GIVEN["A"][:2]})
    with pytest.raises(Refused, match="mu >= 0 is broken"):
        check_sections.problem_of({**GIVEN, "mu": "-1/1000"})


# ---- What hardly shows in a proof, by formulas of the page.


def test_H2_a_constant_counts_with_all_that_it_may_be(steps: list[Step]) -> None:
    step = check_certificate.Step(*steps[-1])
    p = check_certificate.problem_of(Start()._asdict(), Fraction(1))
    wide = Interval(p.lam.low, p.lam.high + (1 << Interval.digits - 10))
    sharp, loose = (check_certificate.defect(x, step)[1] for x in (p, p._replace(lam=wide)))
    _, Qm, M3, *_ = step.series
    one, other = (Fraction(check_certificate.at_end(w, 1), 2 << step.bits) for w in (Qm, M3))
    least = abs(one * other)
    one, other = (Fraction(check_certificate.most(w), 1 << step.bits) for w in (Qm, M3))
    most = one * other
    length = Fraction(step.half, 1 << check_certificate.CLOCK) / 1024
    assert 0 < 0.99 * length * least < loose - sharp < 1.01 * length * most


@pytest.mark.parametrize("mu", ["0", "1/1000"])
def test_H3_gamma_in_a_wide_tube_turns_momentum_the_more(mu: str) -> None:
    """Where M3 = 0 only that makes orbits part: without a weight much of it is the tube's width."""
    start, begin, half = Start(mu=mu), Fraction(1, 1024), 4
    walk = check_certificate.Walk(check_certificate.problem_of(start._asdict(), Fraction(1)))
    step = check_certificate.Step(half << check_certificate.CLOCK, BITS, [])
    found = walk.tube(step, begin, lambda _: (0, 0), 32)
    growth = enclosed(start.problem, PHASE, 128).numbers.growth
    E = arb(4 * begin.numerator) / begin.denominator
    rate = growth.rate(E / 2 / growth.upright, E)
    expected = float(begin) * math.exp(2 * half * float(rate))
    assert float(found) == pytest.approx(expected, rel=1e-9, abs=0)


def test_H5_orbits_have_a_Q_farther_from_zero_than_polynomials(monkeypatch: Any) -> None:
    """On a long step with small Q the rate of M3 is off by B^2 too."""
    start, bound, half, bits = Start(mu="0"), 1 / 64, 8, 60
    monkeypatch.setattr(orbit, "joined", lambda *_: [arb(0)])
    monkeypatch.setattr(orbit, "defects", lambda *_: [arb(0)])
    monkeypatch.setattr(orbit, "tube", lambda *_: (arb(bound), None))
    p = check_certificate.problem_of(start._asdict(), Fraction(1))

    def both(rate: float) -> list[Callable[[], Any]]:
        Q, M3 = (round(x * 2**bits) for x in (2 * 2 * bound, rate))
        series = [[Q, 0], [0, 0], [0, M3], [0, 0], [0, 0], [0, 0]]
        step = Step(half << check_certificate.CLOCK, bits, series)
        own = OrbitChecker(enclosed(start.problem, PHASE, 128))
        walk, other = check_certificate.Walk(p), check_certificate.Step(*step)
        return [
            lambda: own.take(step),
            lambda: walk.crossing(other, range(8, 24), Fraction(bound), 32, 1),
        ]

    limit = same_limit("H5: M3 crosses", 1.0, 0.025, both)
    lam, sigma = (float(x.above) for x in (p.lam, p.sigma))
    expected = half * 2 * 3 * bound / (4 * lam) * bound + bound / sigma
    assert limit == pytest.approx(expected, rel=0.005, abs=0)
