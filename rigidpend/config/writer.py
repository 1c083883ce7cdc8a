"""Writer of configs as YAML text that is read back as the same config."""

from __future__ import annotations

import re
from typing import Any

import yaml


class _Dumper(yaml.SafeDumper):
    """YAML dumper that quotes only what `reader` would not take as text."""

    # Without PyYAML's own: to them a number is something else than its text.
    yaml_implicit_resolvers: dict[str, list[Any]] = {}  # noqa: RUF012

    def ignore_aliases(self, data: Any) -> bool:
        return True


_Dumper.add_implicit_resolver("tag:yaml.org,2002:null", re.compile("^(null|~|)$"), [*"n~", ""])
_Dumper.add_implicit_resolver("tag:yaml.org,2002:bool", re.compile("^(true|false)$"), list("tf"))


def to_yaml(resolved: dict[str, Any]) -> str:
    """Write a resolved config as YAML.

    Parameters
    ----------
    resolved : dict
        What `Config.resolved` gives.
    """
    return yaml.dump(
        _as_text(resolved),
        Dumper=_Dumper,
        default_flow_style=None,
        sort_keys=False,
        allow_unicode=True,
        width=100,
    )


def _as_text(node: Any) -> Any:
    """Copy of the data with every number as its text."""
    if isinstance(node, dict):
        return {key: _as_text(value) for key, value in node.items()}
    if isinstance(node, list):
        return [_as_text(value) for value in node]
    return node if node is None or isinstance(node, bool | str) else repr(node)
