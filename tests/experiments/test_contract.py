"""The contract of experiments: what each folder offers, and that names from files lead nowhere."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from typing import Any

import pytest

from rigidpend import experiments
from rigidpend.experiments.data import FLAG, FLOAT, NUMBER, TEXT, WHOLE, Field, Layout

NAMES = experiments.names()
OWN = {"bench": ("A1", "A2", "A3", "mu", "h0")}
"""Fields whose unit each body has for itself."""


def signature(function: Any) -> str:
    return str(inspect.signature(function)).replace("'", "")


@pytest.mark.parametrize("name", NAMES)
def test_every_experiment_offers_what_the_contract_says(name: str) -> None:
    """Names in annotations are of the contract's own types: mypy sees what they stand for."""
    compute, draw = experiments.computation(name).compute, experiments.drawing(name).draw
    assert signature(compute) == "(config: Config, means: Means) -> Tree"
    assert signature(draw) == "(result: Loaded) -> Figure"
    told = experiments.drawing(name)
    assert signature(told.tables) == "(result: Loaded) -> list[Table]"
    assert told.CAPTION.endswith(".")
    schema = experiments.schema(name)
    assert schema.__module__ == f"rigidpend.experiments.{name}.schema"
    assert experiments.in_pieces(name) is (name == "route_map")
    declared = dict(fields(experiments.layout(name)))
    assert declared
    for field, node in declared.items():
        assert node.kind in {FLOAT, WHOLE, FLAG, TEXT, NUMBER}
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


@pytest.mark.parametrize("name", ["nonesuch", "..run", "route_codes.compute", ""])
def test_a_name_from_a_file_imports_no_other_module(name: str) -> None:
    for part in (experiments.schema, experiments.computation, experiments.drawing):
        said = re.escape(f"no such experiment: {name!r} (known: ")
        with pytest.raises(experiments.UnknownExperiment, match=said):
            part(name)
