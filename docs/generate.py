"""Write the pages that the package itself dictates: settings, gallery, names, modules and more.

Markdown for MyST, one function a page, called by `conf.py` before Sphinx reads the sources.
"""

import importlib
import inspect
import pkgutil
import re
import textwrap
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

import click
from pydantic import BaseModel, ConfigDict, TypeAdapter
from pydantic.fields import FieldInfo

import rigidpend
from docs import floors
from rigidpend import cli, experiments
from rigidpend.config import catalogue
from rigidpend.config.schema import WRITTEN, ExperimentConfig, comment, nested
from rigidpend.machine.wording import Table, markdown
from rigidpend.numbers.exact import Exact
from rigidpend.render import captions
from rigidpend.render.report import DEPARTURES
from rigidpend.runs import loading

COMMON = ("figure", "experiment")
"""The first two keys of every config, of which the page itself tells."""

OPTION = re.compile(r"(?<!\S)--[a-z][a-z-]*")
UNIT = re.compile("radians|dimensionless|physical|seconds|[Dd]irection|units of")
"""A word for the unit, one of which stands in the meaning of every number."""


class Setting(NamedTuple):
    """A key of a config."""

    key: str
    kind: str
    default: str
    meaning: str


def write(folder: Path) -> None:
    """Write every generated page into a folder."""
    folder.mkdir(exist_ok=True)
    pages: dict[str, Callable[[], str]] = {
        "commands": commands,
        "settings": settings,
        "departures": departures,
        "gallery": gallery,
        "names": names,
        "modules": modules,
    }
    for name, page in pages.items():
        (folder / f"{name}.md").write_text(page(), encoding="utf-8")


def commands() -> str:
    """Every command with its usage, text and options, as its --help has them."""
    context = cli.main.make_context("rigidpend", [], resilient_parsing=True)
    parts = [_command(cli.main, context)]
    for name in cli.COMMANDS:
        command = cli.command(name)
        inner = command.make_context(name, [], parent=context, resilient_parsing=True)
        parts.append(_command(command, inner))
    return "\n\n".join(parts) + "\n"


def _command(command: click.Command, context: click.Context) -> str:
    """A section: usage, text, examples and options."""
    usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
    text, _, examples = inspect.cleandoc(command.help or "").partition("\b\n")
    parts = [f"## {context.command_path}", f"```text\n{usage}\n```", plain_text(text)]
    records = [x for x in (p.get_help_record(context) for p in command.get_params(context)) if x]
    parts += [f"`{names}`\n: {plain(said)}" for names, said in records]
    if examples:
        lines = textwrap.dedent(examples.partition("\n")[2]).strip()
        parts.append(f"Examples:\n\n```sh\n{lines}\n```")
    return "\n\n".join(parts)


def plain_text(text: str) -> str:
    """Paragraphs, with nothing in them that Markdown would read as its own."""
    return "\n\n".join(plain(paragraph) for paragraph in text.strip().split("\n\n"))


def settings() -> str:
    """Every experiment's keys."""
    parts = []
    for experiment in experiments.names():
        config = experiments.schema(experiment)
        rows = list(keys(config))
        title = inspect.getdoc(inspect.getmodule(config)) or ""
        head = title.partition("\n")[0].partition(": ")[2].partition(": ")[2]
        parts.append(f"## {experiment}\n\n{head[:1].upper()}{head[1:]}\n\n{_settings(rows)}")
    return "\n\n".join(parts) + "\n"


def _settings(rows: Sequence[Setting]) -> str:
    """A definition list, which a narrow page holds too."""
    return "\n\n".join(f"`{x.key}`\n: {facts(x)} {x.meaning}" for x in rows)


def facts(setting: Setting) -> str:
    """Type and default of a setting, in italics as far as they are words."""
    default = setting.default if setting.default == "required" else f"default {setting.default}"
    return f"{setting.kind}; {default}."


def keys(part: type[BaseModel], prefix: str = "") -> Iterator[Setting]:
    """The settings of a part of a config and of the parts in it, each with its full key.

    Raises
    ------
    ValueError
        A setting without a meaning, or a number without a unit.
    """
    for name, field in part.model_fields.items():
        if name in COMMON and not prefix:
            continue
        key = f"{prefix}{name}"
        inner, named = nested(field.annotation)
        meaning = comment(part, name)
        if inner is not None:
            below = f"{key}.NAME." if named else f"{key}."
            if not meaning:
                meaning = (inspect.getdoc(inner) or "").partition("\n")[0].rstrip(".")
        if not meaning:
            raise ValueError(
                f"{part.__module__}.{part.__name__}.{name}: a setting without a meaning"
            )
        kind, default = described(field.annotation), shown_default(field)
        is_number = "number" in kind.replace("whole number", "")
        if is_number and not UNIT.search(meaning):
            raise ValueError(f"{part.__module__}.{part.__name__}.{name}: a number without a unit")
        yield Setting(key, kind, default, plain(f"{meaning}."))
        if inner is not None:
            yield from keys(inner, below)


def described(annotation: Any) -> str:
    """A type in words."""
    simple = {Exact: "number", int: "whole number", str: "text", bool: "true or false"}
    if annotation in simple:
        return simple[annotation]
    origin, inside = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return described(inside[0])
    if origin is Literal:
        return " or ".join(f"`{value}`" for value in inside)
    if origin in (Union, UnionType):
        return " or ".join(described(x) for x in inside if x is not NoneType)
    if origin is tuple:
        many = inside[-1] is Ellipsis
        return (
            f"list of {described(inside[0])}s" if many else f"{len(inside)} {described(inside[0])}s"
        )
    if origin is dict:
        return f"{described(inside[1])} for each name"
    return "section"


def shown_default(field: FieldInfo) -> str:
    """A default as one would write it; what must be given is said to be required."""
    if field.is_required():
        return "required"
    default = field.get_default(call_default_factory=True)
    if isinstance(default, BaseModel):
        return "as below"
    if default is None:
        # Only a word that a config may hold is one to show.
        kind: Any = Annotated[field.annotation, *field.metadata]
        any_kind = ConfigDict(arbitrary_types_allowed=True)
        return f"`{TypeAdapter(kind, config=any_kind).dump_python(None, context=WRITTEN)}`"
    if isinstance(default, tuple):
        shown = ", ".join(map(str, default))
        return f"`[{shown}]`" if len(default) < 5 else "all"
    return f"`{default or '{}'}`"


def departures() -> str:
    """The places where the paper slips."""
    rows = [tuple(map(plain, departure)) for departure in DEPARTURES.rows]
    return "\n".join(markdown(Table("", ("place", "as printed", "here"), rows))) + "\n"


def gallery() -> str:
    """Every figure that is kept, the paper's first, with its caption and its body."""
    kept = [loading.load(path) for name, path in catalogue.known().items() if shown(name).exists()]
    return "\n\n".join(map(_figure, sorted(kept, key=lambda each: _order(each.content)))) + "\n"


def shown(name: str) -> Path:
    """The kept figure of a config."""
    return floors.ROOT / "results" / "gallery" / f"{name}.png"


def _order(content: ExperimentConfig) -> tuple[bool, str]:
    return not content.figure[:1].isdigit(), content.figure


def _figure(config: loading.LoadedConfig) -> str:
    """A section: the figure, what one sees in it, and the bodies."""
    about = inspect.getdoc(
        importlib.import_module(f"rigidpend.experiments.{config.content.experiment}")
    )
    head = plain((about or "").partition("\n")[0].rstrip("."))
    result: Any = {"config": config.resolved()}
    name = ": ".join(filter(None, [f"`{config.name}`", plain("; ".join(captions.bodies(result)))]))
    said = f"{plain(captions.caption(config.content.experiment))}\n\n{name}"
    figure = f"```{{figure}} ../results/gallery/{config.name}.png\n:alt: {head}\n\n{said}\n```"
    return f"## {head}\n\n{figure}"


def names() -> str:
    """The table of letters in the package's docstring."""
    text = inspect.cleandoc(rigidpend.__doc__ or "").partition("\nNames\n")[2].partition("\n")[2]
    return f"```{{eval-rst}}\n{text.strip()}\n```\n"


def modules() -> str:
    """The floors of the house as a table, then each with its modules, the lowest first."""
    return "\n".join(
        [*floors.picture(), "", *(_module(f"rigidpend.{x}") for x in floors.upwards())]
    )


def _module(name: str) -> str:
    """A section for a module, and one for each in it where it is mathematics."""
    module = __import__(name, fromlist=["_"])
    depth = name.count(".")
    lines = [f"{'#' * min(depth + 1, 4)} {name.partition('.')[2]}", "", "```{eval-rst}"]
    lines.append(f".. automodule:: {name}")
    inside = sorted(found.name for found in pkgutil.iter_modules(getattr(module, "__path__", [])))
    shown = name.split(".")[1] in floors.MATHEMATICS
    if shown and not inside:
        lines.append("   :members:")
    lines += ["```", ""]
    return "\n".join([*lines, *(_module(f"{name}.{part}") for part in inside if shown)])


def plain(text: str) -> str:
    """A text on one line, with nothing in it that Markdown would read as its own."""
    joined = " ".join(text.replace("\\|", "|").split())
    for mark in "|*_<[":
        joined = joined.replace(mark, f"\\{mark}")
    return OPTION.sub(r"`\g<0>`", joined)
