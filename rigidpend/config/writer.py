"""Configs as people read them: YAML that reads back the same, and the differences of two."""

import re
import textwrap
from collections.abc import Iterator, Mapping
from typing import Any

import yaml
from pydantic import BaseModel

from rigidpend.config.overrides import in_one_line
from rigidpend.config.schema import comment, nested
from rigidpend.numbers.texts import everywhere

WIDTH, BESIDE = 80, 36
"""Characters of a line, and of the longest value with its comment beside it."""
INDENT, LONGEST = "  ", 24
"""Blanks before a key in a section, and characters by which YAML may exceed its width."""
SHOWN = 3
"""Number of changes that a sentence lists."""
WORDS = {"beta0": "gamma0"}
"""Words of a config for null, by the last name of the key; `auto` for other keys."""
ABSENT = "nothing"
"""Word for the value of a key that one of two configs lacks."""


class _Dumper(yaml.SafeDumper):
    """YAML dumper that quotes only texts that `reader` would not read as text."""

    # Without PyYAML's own resolvers, for which texts of numbers would need quotes.
    yaml_implicit_resolvers: dict[str, list[Any]] = {}  # noqa: RUF012

    # No anchors, because the reader refuses aliases.
    def ignore_aliases(self, data: Any) -> bool:
        return True


_Dumper.add_implicit_resolver("tag:yaml.org,2002:null", re.compile("^(null|~|)$"), [*"n~", ""])
_Dumper.add_implicit_resolver("tag:yaml.org,2002:bool", re.compile("^(true|false)$"), list("tf"))


def to_yaml(values: dict[str, Any], schema: type[BaseModel]) -> str:
    """Write plain data, numbers as texts, as YAML: each key with its meaning as a comment."""
    lines: list[str] = []
    for key, value in values.items():
        inner, _ = nested(schema.model_fields[key].annotation)
        if inner is None or not isinstance(value, dict):
            lines += dumped({key: value})
        else:
            lines += ["", f"{key}:", *_section(value, inner, INDENT)]
    return "\n".join(lines) + "\n"


def _section(values: dict[str, Any], schema: type[BaseModel], indent: str) -> Iterator[str]:
    """Write a part of a config, with its comments in one column where there is room."""
    texts = {key: dumped({key: value}) for key, value in values.items()}
    firsts = [len(lines[0]) for lines in texts.values() if len(lines) == 1]
    column = max((length for length in firsts if length <= BESIDE), default=0)
    for key, lines in texts.items():
        inner, named = nested(schema.model_fields[key].annotation)
        said = comment(schema, key)
        # A section that YAML writes in one line stays in one line.
        if inner is not None and not named and isinstance(values[key], dict) and len(lines) > 1:
            yield f"{indent}{key}:"
            yield from _section(values[key], inner, indent + INDENT)
        else:
            yield from _commented(lines, said, indent, column)


def _commented(lines: list[str], said: str, indent: str, column: int) -> Iterator[str]:
    """Lines of one key with a comment beside the first, or above if there is no room."""
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
    # YAML may write the root mapping in one line, whose braces are not needed.
    flat = re.fullmatch(r"\{(.*)\}\n", text, re.DOTALL)
    return [" ".join(flat[1].split())] if flat else text.splitlines()


def _as_text(node: Any) -> Any:
    """Copy of the data with every number as its text."""
    if isinstance(node, dict):
        return {key: _as_text(value) for key, value in node.items()}
    if isinstance(node, list):
        return [_as_text(value) for value in node]
    return node if node is None or isinstance(node, bool | str) else repr(node)


def changes(
    before: Mapping[str, Any], after: Mapping[str, Any], prefix: str = ""
) -> dict[str, tuple[Any, Any]]:
    """The two values of each key that differs between two resolved configs, in the second's order.

    The name of the figure is ignored, because no result depends on it.
    """
    found: dict[str, tuple[Any, Any]] = {}
    for key in dict.fromkeys([*after, *before]):
        place = f"{prefix}{key}"
        old, new = before.get(key, ABSENT), after.get(key, ABSENT)
        if place == "figure" or old == new:
            continue
        if isinstance(old, Mapping) and isinstance(new, Mapping):
            found |= changes(old, new, f"{place}.")
        else:
            found[place] = old, new
    return found


def sentence(found: Mapping[str, tuple[Any, Any]]) -> str:
    """Sentence on changes, the first few in full, as ``problem.mu from 1 to 2``."""
    each = (
        (key, *(written(x, key.rpartition(".")[2]) for x in pair)) for key, pair in found.items()
    )
    shown = ", ".join(f"{key} from {old} to {new}" for key, old, new in [*each][:SHOWN])
    more = len(found) - SHOWN
    return f"{shown}, and {more} more" if more > 0 else shown


def written(value: Any, key: str) -> str:
    """Write the value of a key of a resolved config as YAML in one line."""
    return WORDS.get(key, "auto") if value is None else in_one_line(everywhere(value))
