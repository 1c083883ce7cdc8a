"""One self-contained HTML page from a folder of results: figures beside numbers.

The ``draw.py`` of an experiment makes the tables beside its figure: ``tables(result)`` sets the
paper's printed numbers beside the computed ones, from the stored result alone.
Experiments without tables appear with their figure and provenance.
"""

import base64
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rigidpend import experiments, render
from rigidpend.config.catalogue import with_remedy
from rigidpend.machine import files, wording
from rigidpend.machine.files import Absent
from rigidpend.machine.wording import Table
from rigidpend.machine.workers import check_stop, cores, side_by_side
from rigidpend.render import captions
from rigidpend.results import store
from rigidpend.runs.certificate_files import beside, marked, results_in

HERE = Path(__file__).parent
COLOURS = 128
"""Number of colours of an image in the page."""
FEW = 3
"""Largest number of results whose images are reduced in one process; more share the processors."""


class ResultSection(NamedTuple):
    """The section of a result in the page."""

    name: str
    title: str
    order: tuple[bool, str]
    """Sorting key: the paper's figures first, in their order."""
    picture: str = ""
    """Image as a data URI."""
    caption: str = ""
    """Sentences on what the figure shows."""
    bodies: Sequence[str] = ()
    """Phrases on the body, or on each body."""
    tables: Sequence[Table] = ()
    provenance: Sequence[tuple[str, str]] = ()
    problem: str = ""
    """Reason why nothing is shown."""
    doubt: str = ""
    """Note on uncertain symbols, or on something missing beside the figure."""


def results(folder: Path) -> list[Path]:
    """Result files directly in a folder, by name, without certificates; Absent if there is none."""
    found = results_in(folder)
    if not found:
        raise Absent(f"{folder}: no results; call: rigidpend run all --out {folder}")
    return found


def write(sources: Sequence[Path], target: Path) -> list[str]:
    """Write the page for some results, whole or not at all; return sentences on those it lacks.

    The sentences are on the page too. StoreError if none of the results can be shown (Absent if
    there is none), or the page cannot be written.
    """
    page, problems = build(sources)
    files.prepare(target, "choose another file with --to")
    files.write(target, page.encode("utf-8"))
    return problems


def build(sources: Sequence[Path]) -> tuple[str, list[str]]:
    """Build the page that :func:`write` writes, and the list that it returns."""
    jobs = cores() if len(sources) > FEW else 1
    sections = side_by_side(_section, (), True, sources, jobs)
    problems = [said for found in sections if (said := found.problem or found.doubt)]
    # A page of nothing but complaints is no report.
    if all(found.problem for found in sections):
        there = any(source.exists() for source in sources)
        raise (files.StoreError if there else Absent)("\n".join(problems))
    return html(sorted(sections, key=lambda found: found.order)), problems


def _section(source: Path) -> ResultSection:
    """The section of a file, with a sentence as its problem if it cannot be shown."""
    check_stop()
    try:
        result = store.load(source)
        certificate, doubt = None, ""
        try:
            certificate = beside(source)
        except files.StoreError as error:
            doubt = f"nothing is marked as proven: {with_remedy(error)}"
        origin = render.drawn_from(source, str(result["attributes"]["experiment"]))
        drawn = render.kept(source.with_suffix(".png"), origin)
        return section(marked(result, certificate), drawn)._replace(doubt=doubt)
    except files.StoreError as error:
        said = error
    except MemoryError:
        said = files.StoreError(f"{source}: not enough memory to show it")
    except render.OF_VALUES as error:
        # An error in one file, of whatever kind, must not keep the others from being shown.
        said = files.StoreError.of(source, f"cannot be shown: {wording.error(error)}")
    name = source.stem
    return ResultSection(name, name, (True, f" {name}"), problem=with_remedy(said))


def section(result: Any, drawn: bytes | None = None) -> ResultSection:
    """Make the section of a result; its image is drawn now if none is given."""
    attributes = result["attributes"]
    rows = {key: attributes.get(key, "") for key in ("engine", "config_hash", "code_hash")}
    rows |= result["provenance"]
    experiment, figure = str(attributes["experiment"]), str(attributes.get("figure", ""))
    name, what = str(attributes.get("name", "unnamed")), experiment.replace("_", " ")
    # The paper has a figure whose number begins with a digit.
    other = not figure[:1].isdigit()
    title = what.capitalize() + ("" if name == experiment else f": {name}")
    return ResultSection(
        name=name,
        title=title if other else f"Fig. {figure}: {what}",
        order=(other, f"{figure} {name}"),
        picture=picture(drawn or render.image(result, "png")),
        caption=captions.caption(experiment),
        bodies=captions.bodies(result),
        tables=experiments.tables(result),
        provenance=[(key.replace("_", " "), str(value)) for key, value in rows.items()],
    )


def picture(png: bytes) -> str:
    """Encode an image as a data URI, so that the page needs no other file.

    Its colours, which are few, are reduced to a palette, which takes a third of the space.
    """
    from PIL import Image

    small = io.BytesIO()
    with Image.open(io.BytesIO(png)) as full:
        # Without dithering, whose noise in flat colours would not compress.
        reduced = full.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
        # The default compression: the strongest takes five times as long and saves a twentieth.
        reduced.save(small, "png")
    return f"data:image/png;base64,{base64.b64encode(small.getvalue()).decode('ascii')}"


def html(sections: Sequence[ResultSection]) -> str:
    """Write the whole page as HTML."""
    style = (HERE / "page.css").read_text(encoding="utf-8")
    return filled("page.html", sections=sections, departures=DEPARTURES, style=style)


def filled(template: str, **values: Any) -> str:
    """Fill in a template of this folder, everything escaped: names and notes come from files."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(HERE),
        autoescape=True,
        # A name in the template without a value is an error, rather than a gap in the page.
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(template).render(values)


DEPARTURES = Table(
    "Where the paper slips, or leaves a value open, and what is computed here",
    ("place", "as printed", "here"),
    [row.split(" | ") for row in (HERE / "departures.txt").read_text("utf-8").splitlines()],
)
"""All departures, by label in the paper's TeX source or figure, in its order.

`test_departures.py` has a test for each."""
