"""Writer of configs as YAML that is read back as the same config, and that one likes to edit."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from typing import Any

import yaml
from pydantic import BaseModel

from rigidpend.config.schema import comment, nested

WIDTH, BESIDE = 80, 36
"""Characters of a line, and at most of a value that has its comment beside it."""
INDENT, LONGEST = "  ", 24
"""Blanks before a key in a section, and characters by which YAML may go beyond its width."""


class _Dumper(yaml.SafeDumper):
    """YAML dumper that quotes only what `reader` would not take as text."""

    # Without PyYAML's own: to them a number is something else than its text.
    yaml_implicit_resolvers: dict[str, list[Any]] = {}  # noqa: RUF012

    # The reader refuses anchors.
    def ignore_aliases(self, data: Any) -> bool:
        return True


_Dumper.add_implicit_resolver("tag:yaml.org,2002:null", re.compile("^(null|~|)$"), [*"n~", ""])
_Dumper.add_implicit_resolver("tag:yaml.org,2002:bool", re.compile("^(true|false)$"), list("tf"))


def to_yaml(values: dict[str, Any], schema: type[BaseModel]) -> str:
    """Write a config as YAML, each key with its meaning as a comment.

    Parameters
    ----------
    values : dict
        Plain data, numbers as texts.
    schema : type
        The model that the config is checked against.
    """
    lines: list[str] = []
    for key, value in values.items():
        inner, _ = nested(schema.model_fields[key].annotation)
        if inner is None or not isinstance(value, dict):
            lines += dumped({key: value})
        else:
            lines += ["", f"{key}:", *_section(value, inner, INDENT)]
    return "\n".join(lines) + "\n"


def _section(values: dict[str, Any], schema: type[BaseModel], indent: str) -> Iterator[str]:
    """Write a part of a config, its comments in one column where there is room."""
    written = {key: dumped({key: value}) for key, value in values.items()}
    firsts = [len(lines[0]) for lines in written.values() if len(lines) == 1]
    column = max((length for length in firsts if length <= BESIDE), default=0)
    for key, lines in written.items():
        inner, named = nested(schema.model_fields[key].annotation)
        said = comment(schema, key)
        # A part that YAML has put into one line stays there.
        if inner is not None and not named and isinstance(values[key], dict) and len(lines) > 1:
            yield f"{indent}{key}:"
            yield from _section(values[key], inner, indent + INDENT)
        else:
            yield from _commented(lines, said, indent, column)


def _commented(lines: list[str], said: str, indent: str, column: int) -> Iterator[str]:
    """Lines of one key with a comment beside the first, or above where there is no room."""
    first, *rest = lines
    at = len(indent) + max(column, len(first)) + 2
    beside = not rest and len(first) <= BESIDE
    words = textwrap.wrap(said, WIDTH - (at if beside else len(indent)) - 2)
    if beside and words:
        yield f"{indent}{first}".ljust(at) + f"# {words[0]}"
        yield from (f"{' ' * at}# {line}" for line in words[1:])
    else:
        yield from (f"{indent}# {line}" for line in words)
        yield f"{indent}{first}"
    yield from (f"{indent}{line}" for line in rest)


def dumped(values: dict[str, Any]) -> list[str]:
    """YAML of a mapping, line by line."""
    text: str = yaml.dump(
        _as_text(values),
        Dumper=_Dumper,
        default_flow_style=None,
        sort_keys=False,
        allow_unicode=True,
        width=WIDTH - LONGEST,
    )
    # With its root in one line YAML needs no braces around it.
    flat = re.fullmatch(r"\{(.*)\}\n", text, re.DOTALL)
    return [" ".join(flat[1].split())] if flat else text.splitlines()


def _as_text(node: Any) -> Any:
    """Copy of the data with every number as its text."""
    if isinstance(node, dict):
        return {key: _as_text(value) for key, value in node.items()}
    if isinstance(node, list):
        return [_as_text(value) for value in node]
    return node if node is None or isinstance(node, bool | str) else repr(node)
