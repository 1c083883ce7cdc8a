"""The config of Fig. 4 with changes, a small config, and what a complaint must look like."""

from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

import pytest

from rigidpend.config.complaints import Complaint, ConfigError
from rigidpend.config.schema import ExperimentConfig
from rigidpend.runs import loading

C = TypeVar("C", bound=ExperimentConfig)

FIG4 = Path(__file__).resolve().parents[2] / "configs" / "fig4.yaml"
TEXT = FIG4.read_text(encoding="utf-8")

HEAD = """\
figure: "4"
experiment: {experiment}

problem:
  A: [2, 1, 1.5]
  r: [1, 1, 0]
  mu: 0.001
  h0: 1.3342
  J1_0: 1e-8
  n_symbols: {n_symbols}
"""
"""The body of Fig. 4 and where its orbits start: configs of several experiments begin so."""
SMALL = f"""\
{HEAD.format(experiment="route_codes", n_symbols=3)}\
  arrays:
    only: {{start: 1, step: 1/10, count: 5}}

numerics:
  precisions: [53]
"""
"""Five orbits of the body of Fig. 4: computed in a few hundredths of a second."""


def changed(old: str, new: str, text: str = TEXT) -> str:
    """A config in which one thing is written otherwise."""
    assert text.count(old) == 1, old
    return text.replace(old, new)


TINY = changed("count: 5", "count: 2", changed("n_symbols: 3", "n_symbols: 2", SMALL))
"""Two of these orbits with two symbols each, which are soon proven."""


ZOOM = f"""\
{changed("1e-8", "0.05", HEAD.format(experiment="route_zoom", n_symbols=1))}\
  between: [1.5, 1.6]
  step: 1/10
  factor: 4
  levels: 3
  count: 5

numerics:
  precisions: [53, 113]
"""
"""Three levels and their centres, of soon passed orbits: four parts, half a second."""


def written(folder: Path, text: str | bytes, name: str = "given.yaml") -> Path:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def complaint(path: Path, text: str, at: str | int, place: str, message: str) -> str:
    """What must be said of the thing that is written at an index, or where `at` is first."""
    start = text.index(at) if isinstance(at, str) else at
    head = text[:start].rpartition("\n")[2]
    line = head + text[start:].partition("\n")[0]
    where = f"{path}:{text[:start].count(chr(10)) + 1}:{len(head) + 1}"
    middle = f" {place}:" if place else ""
    return f"{where}:{middle} {message}\n    {line}\n    {' ' * len(head)}^"


def refused(path: Path, settings: Sequence[str] = ()) -> list[Complaint]:
    """The complaints with a config, which must be some; the error's text must hold all of them."""
    with pytest.raises(ConfigError) as caught:
        loading.load(path, settings)
    assert caught.value.complaints
    assert str(caught.value) == "\n".join(map(str, caught.value.complaints))
    return caught.value.complaints


def content(kind: type[C], path: Path, settings: Sequence[str] = ()) -> C:
    found = loading.load(path, settings).content
    assert isinstance(found, kind)
    return found
