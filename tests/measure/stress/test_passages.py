"""Growth of errors and decided symbols: what agrees passes, what does not is noticed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend import integrate
from rigidpend.measure.stress import passages
from tests.integrate.problems import FIG4, needs_heyoka

ENGINE = integrate.default_engine()
FAN = passages.Fan(FIG4, 1e-6, 1.4, 11)
H0 = FIG4.kappa * 1.4**2 / 2


def verdicts(tree: Any) -> dict[str, str]:
    return {name: str(case["verdict"].values) for name, case in tree["cases"].items()}


def test_geometric_mean_of_a_normal_error() -> None:
    sample = np.abs(np.random.default_rng(2).normal(size=400_000))
    assert np.exp(np.log(sample).mean()) == pytest.approx(passages.GEOMETRIC, rel=0.01)


@pytest.mark.slow
@needs_heyoka
def test_errors_are_as_predicted_and_others_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    def run() -> Any:
        return passages.error_growth(FAN, orbits=6, n_crossings=8, engine="taylor", jobs=1)

    made = run()
    assert set(verdicts(made).values()) == {"passed"}
    assert 1.5 < made["curves"]["growth_predicted"].values < 5
    monkeypatch.setattr(passages, "DEFAULT_TOLERANCE", {"taylor": 1e-9})
    assert verdicts(run())["size of errors"] == "FAILED"


@pytest.mark.slow
@needs_heyoka
def test_decided_symbols_are_as_predicted_and_right() -> None:
    made: Any = passages.decided_symbols(
        FAN,
        53,
        h0=H0,
        columns=24,
        checked=2,
        n_symbols=60,
        tangents=6,
        engine="taylor",
        jobs=1,
    )
    assert set(verdicts(made).values()) == {"passed"}
    assert 10 < np.median(made["curves"]["measured"].values) < 50


def test_more_bits_decide_more_symbols() -> None:
    few, more = (passages.predicted_symbols(FAN, bits, 40, 2, ENGINE) for bits in (40, 53))
    # Thirteen bits are 9 nats, and a passage takes about one.
    assert 4 < (more - few).mean() < 20


def test_medians_far_apart_fail() -> None:
    random = np.random.default_rng(3)
    near, far = random.normal(30, 5, 50), random.normal(40, 5, 50)
    assert passages._agreement(53, near, near + 1).verdict == "passed"
    assert passages._agreement(53, near, far).verdict == "FAILED"
