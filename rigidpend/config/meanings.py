"""Meanings and units of the keys of configs, from the texts under the fields of their schemas."""

from __future__ import annotations

import ast
import inspect
import textwrap
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel

from rigidpend.numbers.exact import Exact

UNITS = {
    **dict.fromkeys(("A", "bodies", "mu", "M_0", "drawn"), "physical units"),
    **dict.fromkeys(
        ("h", "h0", "J1_0", "half_width", "heights", "factor", "around"), "dimensionless"
    ),
    **dict.fromkeys(("tolerance", "tolerances", "long_tolerances"), "dimensionless"),
    **dict.fromkeys(("theta2_0", "between", "start", "step", "beta0"), "radians"),
    **dict.fromkeys(("azimuth", "elevation"), "radians"),
    **dict.fromkeys(("seconds", "slowest"), "seconds"),
    "ends": "of the axis",
    "r": "a direction",
    **dict.fromkeys(("rows", "columns"), "in units of its axis"),
}
"""The units of settings that are numbers, by their last name. Whole numbers and words have none."""


def meanings(part: type[BaseModel]) -> dict[str, str]:
    """The texts under the fields of a model and of those that it derives from."""
    found: dict[str, str] = {}
    # Derived classes last: what they say of a field wins.
    for base in reversed(part.__mro__):
        if not issubclass(base, BaseModel) or not base.__module__.startswith("rigidpend"):
            continue
        # Python drops texts under fields, so they are read from the source, where each stands once.
        [node] = ast.parse(textwrap.dedent(inspect.getsource(base))).body
        assert isinstance(node, ast.ClassDef)
        for field, text in zip(node.body, node.body[1:], strict=False):
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name):
                if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
                    found[field.target.id] = inspect.cleandoc(str(text.value.value))
    return found


def nested(annotation: Any) -> tuple[type[BaseModel] | None, bool]:
    """The part of a config behind an annotation, and whether it is one of several by name."""
    origin = get_origin(annotation)
    if origin is Annotated:
        return nested(get_args(annotation)[0])
    if origin is dict:
        return nested(get_args(annotation)[1])[0], True
    if origin in (Union, UnionType):
        # A section, or something else in its place: the section's keys are told.
        return next((x for x in map(nested, get_args(annotation)) if x[0]), (None, False))
    if inspect.isclass(annotation) and issubclass(annotation, BaseModel):
        return annotation, False
    return None, False


def comment(part: type[BaseModel], name: str) -> str:
    """Meaning of a key and its unit, as a phrase; empty where the schema says none."""
    meaning = " ".join(meanings(part).get(name, "").replace("\\|", "|").split()).rstrip(".")
    unit = UNITS.get(name, "") if _has_numbers(part.model_fields[name].annotation) else ""
    if not (meaning and unit) or name == "r" or unit.partition(" ")[0] in meaning:
        return meaning
    return f"{meaning}; {unit}"


def _has_numbers(annotation: Any) -> bool:
    """True if a value of that type holds numbers that are not whole."""
    if inspect.isclass(annotation) and issubclass(annotation, BaseModel):
        return any(_has_numbers(field.annotation) for field in annotation.model_fields.values())
    return annotation is Exact or any(map(_has_numbers, get_args(annotation)))
