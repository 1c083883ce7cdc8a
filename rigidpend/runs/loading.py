"""Loading of configs: found by name, read with places, checked against their schema."""

import copy
import functools
import json
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from rigidpend import experiments
from rigidpend.config import catalogue, overrides, reader, validation, writer
from rigidpend.config.complaints import Complaint, ConfigError, Origin, meant
from rigidpend.config.overrides import Setting
from rigidpend.config.reader import Document
from rigidpend.config.schema import WRITTEN, ExperimentConfig
from rigidpend.numbers.texts import everywhere
from rigidpend.orbits.integrate.arithmetic import CLOSED_FORM, Arithmetic, resolve
from rigidpend.runs import provenance

Result = TypeVar("Result")


@dataclass(frozen=True)
class LoadedConfig:
    """A checked config and the name under which its results are stored."""

    name: str
    content: ExperimentConfig
    """Instance of the experiment's schema."""

    def resolved(self) -> dict[str, Any]:
        """All values, defaults included, as plain JSON data; numbers exact."""
        return dict(self.content.model_dump(mode="json"))

    @functools.cached_property
    def config_hash(self) -> str:
        """Digest of all values."""
        return provenance.config_hash(self.resolved())

    @property
    def arithmetic(self) -> Arithmetic:
        """Arithmetic that computes the config, resolved; that of closed forms without numerics."""
        asked = self.content.numerics_asked
        return resolve(**asked) if asked else CLOSED_FORM


def resolved_yaml(config: LoadedConfig) -> str:
    """Write a config with all its defaults as YAML, which :func:`load` reads as the same config.

    Numbers are as they were written, and every key has its meaning and unit beside it. The name
    of the figure is left out, because an edited config makes another figure.
    """
    dumped = config.content.model_dump(mode="json", context=WRITTEN, exclude={"figure"})
    return writer.to_yaml(dumped, type(config.content))


def load(path: Path, settings: Sequence[str] = ()) -> LoadedConfig:
    """Read and check a config, with overrides ``a.b=VALUE``, applied in order.

    ConfigError lists all errors, each with its place in the file.
    """
    [[found]] = load_swept([path], settings)
    return found


def _checked(path: Path, document: Document, settings: Sequence[Setting]) -> ExperimentConfig:
    """Check a config that was read, with settings, each with its origin."""
    overrides.check_free(path.stem, Origin(str(path)))
    if not isinstance(document.tree, dict):
        raise ConfigError.of(document.origin(()), "expected keys: experiment, problem")
    found: list[Complaint] = []
    for setting, origin in settings:
        try:
            overrides.override(document, setting, origin)
        except ConfigError as error:
            found += error.complaints
    try:
        model = experiments.schema(_experiment(document))
        content = model.model_validate(document.tree)
    except ConfigError as error:
        found += error.complaints
    except ValidationError as error:
        found += validation.complaints(document, model, error.errors())
    if found:
        raise ConfigError(sorted(found, key=lambda x: (x.origin.line or 0, x.origin.column or 0)))
    return content


def load_swept(
    paths: Sequence[Path],
    settings: Sequence[str] = (),
    sweeps: Sequence[str] = (),
    name: str | None = None,
    option: str = "--set ",
) -> list[list[LoadedConfig]]:
    """Load the config of each file, or one config for each combination of a sweep.

    Options are ``KEY=VALUE`` and ``KEY=VALUE,VALUE``; complaints about all are raised together, and
    show a setting after the `option` that gave it. The name is that of the result of a single
    file, or the beginning of the names of a sweep's results.
    """
    if name is not None:
        overrides.check_name(name, Origin("--name"))
    options = [overrides.option(text) for text in sweeps]
    given = [(each, Origin(f"{option}{each}")) for each in settings]
    calls = [partial(_swept, path, given, options, name) for path in paths]
    return _together(calls, [path.stem for path in paths])


def _swept(
    path: Path, settings: Sequence[Setting], sweeps: Sequence[Sequence[Setting]], name: str | None
) -> list[LoadedConfig]:
    document = _read(path)
    # Without a sweep there is one variant, with an empty ending and no further settings.
    every = overrides.variants(sweeps)
    # Read once, because all members of a sweep share the file.
    members = _together(
        [
            partial(_checked, path, copy.deepcopy(document), [*settings, *swept])
            for swept in every.values()
        ],
        [path.stem] * len(every),
    )
    # Only the ending is checked: the name of the file itself may be any.
    for ending in every if sweeps else ():
        overrides.check_name(ending, Origin("sweep"))
    changed = bool(settings or sweeps)
    return [
        LoadedConfig(f"{name or path.stem}{ending}", _titled(path, content, changed=changed))
        for ending, content in zip(every, members, strict=True)
    ]


def _together(calls: Sequence[Callable[[], Result]], names: Sequence[str]) -> list[Result]:
    """Call functions that load configs of these names, and raise all their complaints at once."""
    found: list[Result] = []
    whose: dict[Complaint, list[str]] = {}
    for call, name in zip(calls, names, strict=True):
        try:
            found.append(call())
        except ConfigError as error:
            for complaint in error.complaints:
                whose.setdefault(complaint, []).append(name)
    if whose:
        raise ConfigError([_named(*each, set(names)) for each in whose.items()])
    return found


def _named(complaint: Complaint, of: Sequence[str], names: set[str]) -> Complaint:
    """Add to a complaint the configs that an option does not fit, unless it fits none."""
    if complaint.origin.line is not None or set(of) == names:
        return complaint
    return replace(complaint, configs=tuple(dict.fromkeys(of)))


def _read(path: Path) -> Document:
    """Read a config file, or the config that a result was made from."""
    if path.suffix != ".h5":
        return reader.read(path)
    from rigidpend.results import store

    stored = everywhere(store.load(path)["config"])
    return reader.parse(json.dumps(stored, indent=2, ensure_ascii=False), str(path))


def _titled(path: Path, content: ExperimentConfig, *, changed: bool) -> ExperimentConfig:
    """A config without the name of a figure of the paper, if its problem is another one."""
    shipped = tuple(catalogue.shipped())
    own = path.resolve() in shipped and not changed
    if own or not content.of_the_paper or content.problem in _problems(content.figure, shipped):
        return content
    return content.model_copy(update={"figure": ""})


@functools.lru_cache(maxsize=16)
def _problems(figure: str, shipped: tuple[Path, ...]) -> list[Any]:
    """Problems of the shipped configs that make this figure."""
    line = re.compile(rf'^figure: "?{re.escape(figure)}"?$', re.MULTILINE)
    texts = ((path, path.read_text(encoding="utf-8")) for path in shipped)
    return [load(path).content.problem for path, text in texts if line.search(text)]


def _experiment(document: Document) -> str:
    name, known = document.tree.get("experiment"), experiments.names()
    if isinstance(name, str) and name in known:
        return name
    message = "required"
    if name is not None:
        message = f"no such experiment: {name!r}{meant(str(name), known)}"
    place = ("experiment",)
    raise ConfigError.of(document.origin(place), f"{message} {validation.among(known)}", place)
