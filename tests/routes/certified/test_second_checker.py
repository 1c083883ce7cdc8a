"""The second checker: shares nothing with the package, and finds the same numbers."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from flint import arb

from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.routes.certified.balls import enclosed
from rigidpend.routes.problem import RouteProblem
from scripts import check_certificate
from scripts.check_certificate import Interval
from tests.routes.certified.offered import interval

SCRIPTS = sorted(Path(check_certificate.__file__).parent.glob("check_*.py"))
ALLOWED = {"h5py", "yaml"}
STANDARD = {"__future__", "argparse", "ast", "collections", "concurrent", "decimal", "fractions"}
STANDARD |= {"functools", "itertools", "json", "math", "pathlib", "re", "sys", "typing"}
BITS = 128


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
    assert found <= ALLOWED | STANDARD | {""}


def overlap(ball: arb, other: Interval) -> bool:
    """True if both, and each narrow, can hold the same number."""
    mine = interval(ball)
    assert max(x.high - x.low for x in (mine, other)) < 1 << Interval.digits - 100
    return mine.low <= other.high and other.low <= mine.high


@pytest.mark.parametrize(
    ("A", "r", "mu", "h0", "J1_0", "theta2_0"),
    [
        (("2", "1", "3/2"), ("1", "1", "0"), "1/1000", "1.3342", "1e-8", "3*pi/40 + 1/100"),
        (("2", "3/2", "9/5"), ("0", "1", "0"), "1/100", "10/9", "2.39205e-9", "1.02"),
        (("4", "sqrt(2)", "3"), ("1", "2", "0"), "1e-3", "40", "tan(1)", "-atan(7)"),
        # J2_0 = 1/2 exactly, a power of two.
        (("2", "1", "3/2"), ("3", "4", "0"), "1/1000", "1/6", "1/8", "-100"),
    ],
)
def test_the_problem_is_enclosed_as_in_the_package(
    A: tuple[str, ...], r: tuple[str, ...], mu: str, h0: str, J1_0: str, theta2_0: str
) -> None:
    Interval.digits = BITS
    given = {"A": A, "r": r, "mu": mu, "h0": h0, "J1_0": J1_0}
    mine = check_certificate.problem_of(given, check_certificate.number(theta2_0))
    problem = RouteProblem(Body(A=A, r=r, mu=mu), exact(h0), exact(J1_0), 1)
    theirs = enclosed(problem, exact(theta2_0), BITS)
    pairs = zip(theirs.coefficients, [mine.lam, mine.a, mine.b, mine.twist], strict=False)
    assert all(overlap(ball, x) for ball, x in pairs)
    rest = zip(theirs.coefficients[4:], (*mine.torque, *mine.turning), strict=True)
    assert all(overlap(ball, x) for ball, x in rest)
    assert all(overlap(ball, x) for ball, x in zip(theirs.state, mine.start, strict=True))
