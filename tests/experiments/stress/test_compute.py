"""The experiment `stress`: verdicts follow from claims; every trial a part; the exit code."""

import json
import math
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from click.testing import CliRunner

from rigidpend import render
from rigidpend.cli.measure import stress_command
from rigidpend.experiments.stress import LIMIT, PASSED, REFUTED, draw
from rigidpend.experiments.stress import compute as stress
from rigidpend.experiments.stress.scenes import Claim, Trial
from rigidpend.experiments.stress.schema import Addresses, Extremes, LongTime
from rigidpend.numbers.checked import ParameterError
from rigidpend.results import store
from tests.cli.calls import REFERENCE
from tests.experiments.stress.verdicts import asked, verdicts
from tests.experiments.trees import from_file


def claim(name: str, bound: float = 1.0, up_to: float = -math.inf) -> Claim:
    return Claim(name, bound, "what is measured", "the reason", "rad", "known why", up_to)


def trial(kind: str, name: str, claims: Any, *values: float, curve: Any = ()) -> Trial:
    return Trial(kind, name, claims, lambda: (values, dict(curve)))


@pytest.mark.parametrize(
    ("value", "bound", "up_to", "verdict", "ratio"),
    [
        (2.0, 2.0, -math.inf, PASSED, 1.0),
        (3.0, 2.0, 3.0, LIMIT, 1.5),
        (3.1, 2.0, 3.0, REFUTED, 1.55),
        (0.0, 0.0, -math.inf, PASSED, 0.0),
        (1.0, 0.0, -math.inf, REFUTED, math.inf),
        (math.nan, 1.0, 9.0, REFUTED, math.nan),
    ],
)
def test_verdict_and_ratio(
    value: float, bound: float, up_to: float, verdict: str, ratio: float
) -> None:
    told: Any = claim("a", bound, up_to).told(value, "")
    assert told["verdict"] == verdict
    assert told["ratio"] == pytest.approx(ratio, nan_ok=True)


@pytest.mark.parametrize("error", [ParameterError("J1_0", "too small"), ArithmeticError("stuck")])
def test_a_refusal_refutes_every_claim_of_its_trial(error: Exception) -> None:
    made: Any = Trial("k", "t", [claim("a"), claim("b", 1, 9)], Mock(side_effect=error)).tried()
    assert verdicts(made) == {"a": REFUTED, "b": REFUTED}
    assert {x["note"] for x in made["claims"].values()} == {f"refused: {error}"}
    assert made["curves"] == {}


def test_tables_tell_what_was_stored(tmp_path: Path) -> None:
    def loaded(*values: float, note: str = "") -> Any:
        claims = [claim("x", 2), claim("y", 2), claim("z", 2, 6)][: len(values)]
        made: Any = trial("some_group", "t", claims, *values).tried()
        for told in made["claims"].values():
            told["note"] = note if told["name"] == "y" else ""
        tree = {"some_group": {**made, "claims": stress.table(made["claims"])}}
        return from_file(tmp_path, "stress", tree)

    result = loaded(1, math.inf, 5, note="stuck")
    [every] = draw.claims_tables(result)
    assert (every.caption, len(every.rows)) == ("some group", 3)
    assert every.rows[2] == ("z", "5", "2", "2.5", "rad", "limit")
    kinds, beyond = draw.tables(result)
    assert kinds.rows[0] == ("some group", "1", "1", "1", "0.5"), "part of what passed alone"
    assert beyond.rows == [
        ("FAILED", "some group, y", "what is measured; stuck; known why"),
        ("limit", "some group, z", "what is measured; known why"),
    ]
    assert len(draw.tables(loaded(1))) == 1


def trials(config: str) -> list[Trial]:
    return list(stress.trials(asked(config=config), 1))


def test_every_claim_is_that_of_the_stored_trials_with_the_bound_that_was_declared() -> None:
    """Theory or other orbits gave it, as its reason says; so of how far a known limit goes."""
    stored = store.load(REFERENCE.parent / "measured" / "stress.h5")["data"]
    every, quick = trials("stress"), trials("stress_quick")
    assert list(dict.fromkeys(x.kind for x in every)) == list(stored)
    assert len({f"{x.kind}.{x.label}" for x in every}) == len(every)
    for kind, group in stored.items():
        claims = [claim for each in every if each.kind == kind for claim in each.claims]
        for key in ("name", "unit"):
            assert [getattr(x, key) for x in claims] == group["claims"][key].tolist()
        bounds = [[x.bound, max(x.bound, x.up_to)] for x in claims]
        np.testing.assert_allclose(
            np.transpose(bounds), [group["claims"][key] for key in ("bound", "up_to")], rtol=1e-12
        )
    # What a config leaves out is what the full one says.
    assert list(dict.fromkeys(x.kind for x in quick)) == list(stored)
    full = asked(config="stress")
    assert (full.long_time, full.extremes, full.addresses) == (LongTime(), Extremes(), Addresses())


@pytest.mark.slow
@pytest.mark.parametrize(("value", "told", "code"), [(0.5, 0.5, 0), (math.inf, None, 1)])
def test_command_draws_tells_and_ends_as_the_claims_do(
    value: float, told: Any, code: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Claims of one kind come together."""
    every = [
        trial("a", "first = 1", [claim("x")], value),
        trial("a", "second", [claim("y", 1, 2)], 2.0),
        trial("b", "third", [claim("z")], 0.5),
    ]
    monkeypatch.setattr(stress, "trials", lambda *_: every)
    monkeypatch.setattr(render, "render", lambda _, target: target.write_text("drawn"))
    result, again = (
        CliRunner().invoke(stress_command, ["--quick", *more, "--out", str(tmp_path)])
        for more in (["--json"], [])
    )
    assert (result.exit_code, again.exit_code) == (code, code), result.output
    found = json.loads(result.stdout)["data"]
    assert found["a"]["claims"]["name"] == ["x", "y"]
    assert found["a"]["claims"]["value"] == [told, 2]
    assert found["b"]["claims"]["verdict"] == ["passed"]
    assert "2/3: a, second: limit" in result.stderr
    assert store.load(tmp_path / "stress_quick.h5")["attributes"]["experiment"] == "stress"
    assert (tmp_path / "stress_quick.png").read_bytes() == b"drawn"
    assert "is up to date" in again.stderr
    beyond = again.stdout.partition("Beyond their bounds")[2]
    assert ("a, x" in beyond, "a, y" in beyond) == (bool(code), True)
