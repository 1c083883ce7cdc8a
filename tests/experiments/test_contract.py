"""The contract of experiments: what each folder offers and describes, and what a run costs."""

import inspect
import re
from collections.abc import Iterator
from typing import Any

import pytest
from matplotlib.figure import Figure

from rigidpend import experiments
from rigidpend.config import catalogue
from rigidpend.config.description import Row
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import FLAG, FLOAT, TEXT, WHOLE, Field, Layout, Loaded, Tree
from rigidpend.machine.wording import Table
from rigidpend.runs import loading

NAMES = experiments.names()
OWN = {"bench": ("A1", "A2", "A3", "mu", "h0")}
"""Fields whose unit each body has for itself."""


def types(function: Any) -> dict[str, Any]:
    return inspect.get_annotations(function, eval_str=True)


@pytest.mark.parametrize("name", NAMES)
def test_every_experiment_offers_what_the_contract_says(name: str) -> None:
    schema, computation = experiments.schema(name), experiments.computation(name)
    assert types(computation.compute) == {"config": schema, "means": Means, "return": Tree}
    told = experiments.drawing(name)
    assert types(told.draw) == {"result": Loaded, "return": Figure}
    assert types(told.tables) == {"result": Loaded, "return": list[Table]}
    assert told.CAPTION.endswith(".")
    assert schema.__module__ == f"rigidpend.experiments.{name}.schema"
    assert getattr(computation, "PIECES", name not in ("route_codes", "route_map"))
    declared = dict(fields(experiments.layout(name)))
    assert declared
    for field, node in declared.items():
        assert node.kind in {FLOAT, WHOLE, FLAG, TEXT}
        if field not in OWN.get(name, ()):
            assert node.description, field
            assert node.units or node.kind == TEXT, field


def fields(layout: Layout) -> Iterator[tuple[str, Field]]:
    for name, node in layout.items():
        assert name.strip("<>?").replace(" ", "_").isidentifier(), name
        if isinstance(node, Field):
            yield name.strip("?"), node
        else:
            yield from fields(node)


def test_many_pieces_go_to_processes_of_one_thread() -> None:
    names = [f"piece{k}" for k in range(8)]
    assert [Means(jobs=2).threads(names[:count]) for count in (1, 7, 8)] == [2, 2, 1]
    # Those that an interrupted run has stored do not count.
    assert Means(jobs=2, stored=lambda name: name == "piece3").threads(names) == 2


@pytest.mark.parametrize("name", ["nonesuch", "..run", "route_codes.compute", ""])
def test_a_name_from_a_file_imports_no_other_module(name: str) -> None:
    for part in (experiments.schema, experiments.computation, experiments.drawing):
        said = re.escape(f"no such experiment: {name!r} (known: ")
        with pytest.raises(experiments.UnknownExperiment, match=said):
            part(name)


KNOWN = catalogue.known()
ROWS = {
    "fig1": {"alpha0": "1.9106332362490186", "view elevation": "pi/8"},
    "fig2": {"gamma0": "1.5707963267948966"},
    "fig3": {"body a": "alpha0 = 2.91891, gamma0 = 2.46192, nu = 1.756", "beta0": "gamma0"},
    "fig4": {"J1_0": "1e-8", "arrays right": "start = 3*pi/40, step = 1/100, count = 32"}
    | {"special cases": "Grioli", "A": "2, 1, 1.5"},
    "fig4_zoom": {"between": "4.7, 4.8", "steps": "0.1 to 2.44e-12"},
    "fig5": {"cases case2": "theta2_0 = 1.83"},
    # mu pi kappa/h0 sin(theta1/2)/sin(alpha0) with kappa = 4/3, sin(alpha0) = sqrt(8)/3.
    "precession": {"body i": "+0.25651, +0.25651, -0.25651, -0.25651", "drawn": "0.1"},
    # 8 sin(theta1/2)/(J2^2 sin(alpha0)) nu/sinh(nu) with J2^2 = 2/kappa, by hand.
    "splitting": {"body fig4": "nu = 4.443, distance = 0.5828 mu cos g"},
    "route_map": {"theta2_0": "ends = 0, 2*pi, count = 500", "columns": "auto"},
    "closed_orbits": {"words": "114", "longest": "8"},
}
"""Rows of some configs, as they are written there or follow by hand."""


def described(name: str, *settings: str) -> dict[str, Row]:
    loaded = loading.load(KNOWN[name], settings)
    rows = experiments.describe(loaded.content)
    assert len({row.name for row in rows}) == len(rows)
    return {row.name: row for row in rows}


@pytest.mark.parametrize("name", sorted(KNOWN))
def test_every_key_is_told_with_its_meaning(name: str) -> None:
    rows, problem = described(name), loading.load(KNOWN[name]).content.problem
    assert all(row.value and row.meaning for row in rows.values())
    told = {row.partition(" ")[0] for row in rows}
    assert told >= set(type(problem).model_fields)
    assert {key: rows[key].value for key in ROWS.get(name, {})} == ROWS.get(name, {})


def test_numbers_are_numbers_for_programs_too() -> None:
    rows = described("fig4", "problem.mu=1/3")
    assert (rows["mu"].value, rows["mu"].number) == ("1/3", 1 / 3)
    assert rows["n_symbols"].number == 15
    assert "mu" not in described("fig1"), "a body without weight"
    zeros = rows["Melnikov zeros"].number
    assert zeros == pytest.approx([1.563050, 4.704643], abs=1e-2)
    assert described("fig2")["separatrices"].number == pytest.approx(
        [-0.339837, 3.481430, 5.943348, 9.764615], abs=1e-6
    )


PLANE = "problem.zooms={}", "problem.n_symbols=15"
ROWS_OF = "problem.rows={axis: log10_J1_0, ends: [-10, -5], count:"
COSTS: dict[tuple[str, ...], tuple[float, float]] = {
    ("fig4", "problem.n_symbols=15"): (0.2, 2),
    ("fig4", "problem.n_symbols=300", "numerics.precisions=[53]"): (0.3, 3),
    ("fig4", "problem.n_symbols=300"): (10, 100),
    ("fig4_zoom", "problem.levels=3", "problem.count=6", "problem.n_symbols=4"): (0.1, 1),
    ("route_map", *PLANE, "problem.theta2_0.count=30", f"{ROWS_OF} 20}}"): (0, 3),
    ("route_map", *PLANE, "problem.theta2_0.count=1250", f"{ROWS_OF} 800}}"): (3, 60),
}
"""By config and settings: between what a run takes at least and at most, seconds, as measured.

Other experiments, and other bodies, are in `test_costs.py`."""


@pytest.mark.parametrize("case", COSTS, ids=" ".join)
def test_the_cost_is_that_of_the_run(case: tuple[str, ...]) -> None:
    name, *settings = case
    seconds = float(described(name, *settings)["cost"].value.split()[1])
    least, most = COSTS[case]
    assert least < seconds < most


def test_a_long_cost_is_told_in_minutes() -> None:
    """Half rotations decide it, and the orbits that they allow are too many for seconds."""
    value = described("asymptotic_orbits", "problem.half_turns=12")["cost"].value
    assert re.fullmatch(r"about \d+ min", value), value
