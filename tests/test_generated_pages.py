"""The pages that the package dictates: nothing is missing in them, nothing without a meaning."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import click
import pytest
from pydantic import BaseModel

from docs import generate
from rigidpend import cli, experiments
from rigidpend.config import catalogue
from rigidpend.config.schema import Number, Part
from rigidpend.render.report import DEPARTURES
from rigidpend.runs import loading

NAMED = {"problem.bodies", "problem.arrays", "problem.cases", "problem.zooms"}
"""Sections whose keys are names of the user's choice."""


def written(node: Any, place: str = "") -> Iterator[str]:
    """The keys of a config file, names of the user's choice as NAME."""
    for key, value in node.items():
        here = f"{place}{'NAME' if place[:-1] in NAMED else key}"
        if not isinstance(value, dict) or here == "problem.bodies.NAME":
            yield here
        else:
            yield here
            yield from written(value, f"{here}.")


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(catalogue.known()))
def test_every_key_of_a_shipped_config_is_on_the_page(name: str) -> None:
    loaded = loading.load(catalogue.known()[name])
    told = {setting.key for setting in generate.keys(experiments.schema(loaded.experiment))}
    free = {f"{section}.NAME" for section in NAMED}
    asked = {key for key in written(loaded.resolved()) if "." in key} - free
    by_name = ("problem.passages.columns.", "problem.passages.checked.")
    assert {key for key in asked if not key.startswith(by_name)} <= told
    assert len(asked) > 1


def test_a_key_is_told_with_type_unit_default_and_meaning() -> None:
    told = {setting.key: setting for setting in generate.keys(experiments.schema("route_codes"))}
    assert told["problem.arrays.NAME.step"].meaning.endswith(", radians.")
    assert told["problem.arrays.NAME.step"].default == "required"
    assert told["problem.n_symbols"].kind == "whole number"
    assert told["problem.n_symbols"].default == "`15`"
    assert told["numerics.engine"].kind == "`taylor` or `scipy`"
    assert told["numerics.engine"].default == "`auto`"
    assert told["numerics.precisions"].kind == "list of whole numbers"
    assert told["problem.A"].meaning.startswith("Principal moments of inertia")


class Silent(Part):
    n: int = 1


class Bare(Part):
    x: Number
    """A number of no unit that anyone knows."""


@pytest.mark.parametrize(("part", "said"), [(Silent, "a meaning"), (Bare, "a unit")])
def test_a_key_without_meaning_or_unit_stops_the_build(part: type[BaseModel], said: str) -> None:
    with pytest.raises(ValueError, match=rf"pages\.{part.__name__}\..: .*without {said}"):
        list(generate.keys(part))


def test_every_command_is_there_with_its_options_and_examples() -> None:
    page = generate.commands()
    for name, command in ((name, cli.command(name)) for name in cli.COMMANDS):
        part = page.partition(f"\n## rigidpend {name}\n")[2].partition("\n## ")[0]
        for parameter in command.params:
            if isinstance(parameter, click.Option):
                assert all(option in part for option in parameter.opts), (name, parameter.opts)
        examples = (command.help or "").partition("Examples:\n")[2].splitlines()
        assert all(line.strip() in part for line in examples), name
    assert "\b" not in page


def test_every_departure_is_there() -> None:
    lines = generate.departures().splitlines()[2:]
    assert [line.replace("\\", "") for line in lines] == [
        f"| {' | '.join(departure)} |" for departure in DEPARTURES.rows
    ]
