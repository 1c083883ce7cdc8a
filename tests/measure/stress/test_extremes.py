"""The extremes are what their names say, and a wrong symbol is noticed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend import Body, integrate
from rigidpend.measure.stress import extremes, starts
from rigidpend.measure.stress.cases import FAILED, LIMIT, PASSED
from rigidpend.routes import route_codes

ENGINE = integrate.default_engine()
EVERY = (*extremes.BODIES, *extremes.ENERGIES, *extremes.LOWER, *extremes.UPPER)


def run(extreme: extremes.Extreme) -> Any:
    return extremes.route_cases(extreme, columns=1, n_symbols=1, engine=ENGINE, jobs=1)


def test_names_are_unique() -> None:
    names = [x.name for x in EVERY] + [x.name for x in starts.PLACES]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("name", ["Hess", "Grioli", "flat"])
def test_special_bodies_are_special(name: str) -> None:
    [member] = [x for x in extremes.BODIES if x.name == name]
    assert name in Body(member.A, member.r, member.mu).special_cases


def test_every_body_is_one() -> None:
    angles = [Body(x.A, x.r, x.mu).angles() for x in EVERY]
    assert min(p.alpha0 for p in angles) < 0.11
    assert max(p.alpha0 for p in angles) > np.pi - 0.11
    assert {p.beta0 for p in angles} >= {0.0, np.pi}


def test_an_ordinary_route_passes() -> None:
    assert [x.verdict for x in run(extremes.Extreme("x", J1_0="1e-3"))] == [PASSED, PASSED]


def test_a_wrong_certain_symbol_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(*given: Any, **named: Any) -> Any:
        made = route_codes(*given, **named)
        return made._replace(separatrix=made.separatrix % 4 + 1)

    monkeypatch.setattr(extremes, "route_codes", wrong)
    assert [x.verdict for x in run(extremes.Extreme("x", J1_0="1e-3"))] == [FAILED, PASSED]


def test_a_refusal_is_a_limit_with_its_words() -> None:
    error, uncertain = run(extremes.Extreme("x", J1_0="5"))
    assert (error.verdict, uncertain.verdict) == (PASSED, LIMIT)
    assert "0 < J1_0 < J2_0 is broken" in uncertain.limit
