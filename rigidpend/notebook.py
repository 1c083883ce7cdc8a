"""Notebooks: load results with labels, compute and draw them in one line, follow orbits in time.

``rigidpend.load``, ``run``, ``plot``, ``orbit`` and ``theory`` are these functions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigidpend import experiments
from rigidpend.config.catalogue import RESULTS, resolve, with_remedy
from rigidpend.config.complaints import Origin
from rigidpend.machine import files
from rigidpend.machine.wording import Table, columns
from rigidpend.numbers import Array, checked
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import PRECISIONS
from rigidpend.numbers.texts import words

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from rigidpend.config.description import Row
    from rigidpend.experiments.data import Data, Layout, Loaded
    from rigidpend.mechanics.body import Body
    from rigidpend.routes.herpolhode import SampledOrbit

POINTS = 60
"""Samples in a rotation of the pendulum, if no step is given: as many as in Fig. 5."""
OPTIONS = {
    "with --out": "as `folder`",
    "with --name": "as `called`",
    "overwrite it with --force": "remove it",
}
"""Advice of the command `run`, by its options, and what it is for :func:`run`."""
MOST_SAMPLES, SAMPLE = 2_000_000, 350
"""Largest number of samples of an orbit, and bytes of memory that each takes while it is made."""
MOST_ROTATIONS, ROTATION = 10_000_000, 3e-5
"""Largest number of rotations of the pendulum in an orbit, and measured seconds for one."""


@dataclass(frozen=True, repr=False)
class StoredResult:
    """A result, loaded: its attributes, config and data."""

    path: Path
    loaded: Loaded

    @property
    def name(self) -> str:
        return str(self.loaded["attributes"].get("name", self.path.stem))

    @property
    def experiment(self) -> str:
        return str(self.loaded["attributes"]["experiment"])

    @property
    def config(self) -> dict[str, Any]:
        """The config with every default; numbers are exact, as text."""
        return self.loaded["config"]

    @property
    def values(self) -> Mapping[str, Any]:
        """The data as plain arrays, texts and groups by name."""
        return self.loaded["data"]

    @property
    def words(self) -> dict[str, list[str]]:
        """Route codes as strings, one for each orbit, by array: ``?`` marks an uncertain symbol."""
        from rigidpend.experiments.shared import arrays

        groups = arrays(self.values).items()
        held = {name: x for name, x in groups if isinstance(x, Mapping) and "certain" in x}
        return {name: words(x["codes"], x["certain"]) for name, x in held.items()}

    @cached_property
    def data(self) -> xarray.DataTree:
        """The data with their dimensions, coordinates, units and meanings.

        Raises
        ------
        ModuleNotFoundError
            xarray is not installed: it is in the extra `notebook`.
        """
        import xarray

        layout = experiments.layout(self.experiment)
        made = xarray.DataTree.from_dict(dict(_datasets("", self.values, layout)))
        made.attrs.update(self.loaded["attributes"])
        return made

    def __getitem__(self, key: str) -> Any:
        try:
            return self.data[key]
        except KeyError:
            raise KeyError(f"{key!r} (known: {', '.join(self.values)})") from None

    def __repr__(self) -> str:
        from rigidpend.render import captions

        said = "; ".join(captions.bodies(self.loaded)[:1])
        groups = ", ".join(list(self.values)[:6])
        doubt = str(self.loaded["attributes"].get("doubt", ""))
        parts = (f"{self.experiment} {self.name!r}", said, f"data: {groups}", doubt)
        return f"<{'; '.join(filter(None, parts))}>"

    def _repr_html_(self) -> str:
        from rigidpend.render import captions

        lines = "".join(f"<br>{escape(line)}" for line in captions.bodies(self.loaded))
        head = f"<p><b>{escape(self.name)}</b> ({escape(self.experiment)}){lines}</p>"
        try:
            tree: Any = self.data
            return f"{head}{tree._repr_html_()}"
        # xarray is an extra: without it a result is still shown, by its head alone.
        except ModuleNotFoundError:
            return head


def _datasets(path: str, data: Data, layout: Layout) -> Iterator[tuple[str, xarray.Dataset]]:
    """Datasets of a group and its subgroups, with their paths."""
    import numpy as np
    import xarray

    from rigidpend.experiments.data import Field, declared

    variables, coordinates = {}, []
    for key, node in declared(layout, data).items():
        if not isinstance(node, Field):
            yield from _datasets(f"{path}/{key}", data[key], node)
            continue
        # xarray needs a name for each dimension: one given as a mere size takes the array's name.
        sizes = enumerate(node.dimensions)
        dims = [size if isinstance(size, str) else f"{key}_{k}" for k, size in sizes]
        variables[key] = xarray.Variable(dims, np.asarray(data[key]), node.meaning)
        coordinates += [key] if node.coordinate else []
    yield path or "/", xarray.Dataset(variables).set_coords(coordinates)


class TheoryTable(tuple["Row", ...]):
    """Table of a body by the paper's theory; ``table[name]`` gives a value."""

    def __getitem__(self, key: Any) -> Any:
        if not isinstance(key, str):
            return super().__getitem__(key)
        found = [row for row in self if row.name == key]
        if not found:
            raise KeyError(f"{key!r} (known: {', '.join(row.name for row in self)})")
        return found[0].value if found[0].number is None else found[0].number

    def __repr__(self) -> str:
        return "\n".join(columns([row[:3] for row in self], 100))

    def _repr_html_(self) -> str:
        from rigidpend.render import report

        table = Table("", ("name", "value", "meaning"), [row[:3] for row in self])
        return report.filled("table.html", table=table)


def load(source: Path | str) -> StoredResult:
    """Load a result.

    Parameters
    ----------
    source : Path or str
        File ``RESULT.h5``, or the name of a result in ``results/``.

    Raises
    ------
    ParameterError, StoreError
        The source is no path; or there is no such file, or it cannot be read.
    """
    from rigidpend.results import store

    path = checked.path("source", source)
    if path.suffix != ".h5":
        path = RESULTS / f"{source}.h5"
    try:
        return StoredResult(path, store.load(path))
    except files.StoreError as error:
        raise type(error)(with_remedy(error)) from None


def run(
    name: str | Path,
    settings: Mapping[str, Any] | None = None,
    *,
    folder: Path | str = RESULTS,
    called: str | None = None,
    jobs: int | None = None,
    progress: Callable[[str], None] | None = None,
    **problem: Any,
) -> StoredResult:
    """Compute a config, unless its result is up to date, and load the result.

    Parameters
    ----------
    name : str or Path
        Name of a config, as of ``rigidpend list``, or a file.
    settings : mapping, optional
        Values by their full keys, ``{"numerics.engine": "scipy"}``.
    folder : Path or str, optional
        Folder of the result.
    called : str, optional
        Name of the result; by default it contains the values that are set, as in
        ``fig4_mu=0.01``.
    jobs : int, optional
        Number of threads; by default one for each processor.
    progress : callable, optional
        Receiver of lines of progress. By default a run that takes longer than three seconds
        writes them to stderr: in a notebook or terminal as one changing line, with the time left.
    **problem
        Values of the section `problem`, as ``mu="0.01"``. Text is exact as written; a float is
        written with the fewest digits that reproduce it.

    Raises
    ------
    ParameterError, ConfigError, StoreError
        An argument is of the wrong kind, or the command `run` would report the same error.
    """
    from rigidpend.config import overrides
    from rigidpend.machine import workers
    from rigidpend.machine.progress import Progress
    from rigidpend.runs import loading, runner

    pairs = checked.of_kind("settings", {} if settings is None else settings, Mapping)
    if progress is not None:
        checked.of_kind("progress", progress, Callable)
    folder = checked.path("folder", folder)
    if jobs is not None:
        jobs = checked.whole("jobs", jobs, 1)
    pairs = {**pairs, **{f"problem.{key}": value for key, value in problem.items()}}
    given = [(str(key), overrides.in_one_line(value)) for key, value in pairs.items()]
    paths = resolve((str(checked.path("name", name)),), folder)
    if len(paths) != 1:
        raise ParameterError("name", f"{name} names {len(paths)} configs: give one of them")
    [path] = paths
    # The name that a sweep would give it, so that either finds the other's result.
    ending = overrides.ending(given)
    options = [f"{key}={value}" for key, value in given]
    if called is not None:
        overrides.check_name(called, Origin("called"))
    elif ending:
        overrides.check_name(ending, Origin("the values make no name: give one as `called`"))
    [[config]] = loading.load_swept([path], options, option="")
    config = replace(config, name=f"{path.stem}{ending}" if called is None else called)
    try:
        planned = runner.plan(config, folder)
        if planned.reason:
            jobs = workers.cores() if jobs is None else jobs
            expected = {config.name: cost} if (cost := runner.expected_seconds(planned)) else {}
            with Progress(1, expected, patient=True) as display:
                hear = partial(display.hear, config.name)
                say = hear if progress is None else lambda x: progress(f"{config.name}: {x}")
                runner.follow(planned, jobs, say)
    except files.StoreError as error:
        for option, here in OPTIONS.items():
            error.args = (str(error).replace(option, here),)
        raise
    return load(planned.target)


def plot(result: StoredResult | Path | str) -> Figure:
    """Draw a result as `rigidpend render` does, as a figure of Matplotlib."""
    from matplotlib import rc_context

    from rigidpend import render

    stored = result
    if not isinstance(stored, StoredResult):
        stored = load(checked.path("result", stored))
    with rc_context(fname=render.STYLE):
        return experiments.drawing(stored.experiment).draw(stored.loaded)


def orbit(
    body: Body,
    theta2_0: Any,
    *,
    h0: Any,
    J1_0: Any,
    time: float,
    step: float | None = None,
    engine: str | None = None,
) -> SampledOrbit:
    """Integrate an orbit on S1- in double precision, with its angles and its hodograph.

    It starts as the orbits of `route_codes` do, at theta1_0 = alpha0 + beta0, with theta3 = 0.

    Parameters
    ----------
    body : Body
    theta2_0 : number
        Initial phase, radians.
    h0 : number
        Energy constant, physical units as mu.
    J1_0 : number
        Initial action, dimensionless.
    time : float
        Duration in t', dimensionless.
    step : float, optional
        t' between samples, of which the last is at `time`; by default a sixtieth of a rotation
        of the pendulum.
    engine : {"taylor", "scipy"}, optional
        `taylor` by default.

    Raises
    ------
    ParameterError, EngineError
        An excluded value, an unknown engine, or more samples or rotations than `MOST_SAMPLES`
        and `MOST_ROTATIONS`.
    """
    from rigidpend.mechanics import in_space
    from rigidpend.orbits.integrate.arithmetic import resolve
    from rigidpend.orbits.integrate.states import states_at
    from rigidpend.routes import herpolhode
    from rigidpend.routes.phases import Phases
    from rigidpend.routes.problem import RouteProblem, rotation_period

    # The number of symbols does not affect an orbit in time; a problem needs at least one.
    problem = RouteProblem(body, h0, J1_0, 1)
    period = rotation_period(problem)
    times = _samples(time, period / POINTS if step is None else step, period)
    arithmetic = resolve(engine, None, PRECISIONS)
    phase = Phases([checked.number("theta2_0", theta2_0)]).near[0]
    states = states_at(
        in_space.field(body),
        herpolhode.initial_state(problem, phase),
        times,
        engine=arithmetic.engine,
        tolerance=float(arithmetic.tolerance),
    )
    return herpolhode.samples(body, times, states)


def theory(body: Body, h0: Any, J1_0: Any = None) -> TheoryTable:
    """Make the table of a body by the paper's theory: Melnikov's zeros, multipliers and more.

    Parameters
    ----------
    body : Body
    h0 : number
        Energy constant, greater than mu.
    J1_0 : number, optional
        Initial action, dimensionless; only Melnikov's zeros depend on it.

    Raises
    ------
    ParameterError
        h0 or J1_0 is out of range.
    """
    from rigidpend.config.theory import rows

    return TheoryTable(rows(body, h0, J1_0))


def _samples(time: Any, step: Any, period: float) -> Array:
    """Times t' of samples from 0 to `time`, a step apart; the last step may be shorter.

    A request that would take hours or all memory is refused with its time or size.
    """
    import numpy as np

    end, apart = (float(checked.number(*given)) for given in (("time", time), ("step", step)))
    for name, value in (("time", end), ("step", apart)):
        if not 0 < value < float("inf"):
            raise ParameterError(name, f"{name} must be a number above 0, got {value}")
    count, rotations = end / apart, end / period
    if count > MOST_SAMPLES:
        needed = f"{count:.3g} samples, {count * SAMPLE / 1e9:.3g} GB of memory"
        message = f"time = {end:g} in steps of {apart:.3g} takes {needed}; {MOST_SAMPLES} samples"
        raise ParameterError("time", f"{message} are the most: shorten time or lengthen step")
    if rotations > MOST_ROTATIONS:
        needed = f"{rotations:.3g} rotations of the pendulum, about {rotations * ROTATION:.2g} s"
        message = f"time = {end:g} takes {needed}; {MOST_ROTATIONS} rotations are the most"
        raise ParameterError("time", f"{message}: give at most {MOST_ROTATIONS * period:.3g}")
    # Without 1e-9, a count rounded up by one bit would give two samples at nearly the same end.
    return np.append(apart * np.arange(math.ceil(count - 1e-9)), end)
