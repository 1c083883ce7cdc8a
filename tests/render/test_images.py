"""Images in files: equal for equal results, kept while up to date, refused in a sentence."""

import re
import shutil
import struct
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import matplotlib
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rigidpend import render
from rigidpend.experiments.heteroclinic_cycle import draw
from rigidpend.machine.files import StoreError
from rigidpend.render import report
from rigidpend.runs import certificate_files
from tests.cli.calls import REFERENCE, call
from tests.experiments.trees import reference
from tests.processes import python

STARTS = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}
FAULTS = (NameError, TypeError, AttributeError, ImportError, AssertionError)
GALLERY = REFERENCE.parent / "gallery"
MOST, OF = render.PIXELS, "heteroclinic_cycle"
OF_VALUES = (ValueError, ZeroDivisionError, IndexError)


def small(_: Any) -> Figure:
    """A figure that is soon drawn, with markers and areas, which have names of their own in SVG."""
    figure = Figure(figsize=(3, 2))
    axes = figure.subplots()
    axes.plot([0, 1], "o-", label="a")
    axes.fill_between([0, 1], [1, 2], hatch="/")
    axes.set_xlabel(r"$\theta$")
    return figure


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A result whose image is small."""
    monkeypatch.setattr(draw, "draw", small)
    monkeypatch.setattr(render, "PIXELS", 300)
    return Path(shutil.copy(REFERENCE / "fig2.h5", tmp_path / "fig2.h5"))


@pytest.mark.slow
def test_matplotlib_says_nothing_of_its_surroundings(
    source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No display and no place for its cache of fonts, though the image is known already."""
    page, picture = source.with_name("page.html"), source.with_suffix(".png")
    render.render(source, picture)
    for name in ("MPLCONFIGDIR", "XDG_CONFIG_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(source / "in a file"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(source.parent))
    monkeypatch.setenv("MPLBACKEND", "nonsense")
    done = python(source.parent, "-m", "rigidpend", "report", str(source), "--to", str(page))
    assert (done.stderr, done.returncode) == (f"{page} written\n", 0)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", STARTS)
def test_equal_results_give_equal_images_whenever_and_wherever_drawn(
    source: Path,
    monkeypatch: pytest.MonkeyPatch,
    suffix: str,
    caplog: pytest.LogCaptureFixture,
) -> None:
    one, other = (source.with_name(f"{name}.{suffix}") for name in "ab")
    # What matplotlib takes for the time of day, and what a reader may have set.
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    render.render(source, one)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1000000000")
    with matplotlib.rc_context({"font.size": 17, "savefig.dpi": 51, "savefig.bbox": "tight"}):
        before = dict(matplotlib.rcParams)
        render.render(source, other)
        assert dict(matplotlib.rcParams) == before
    assert one.read_bytes() == other.read_bytes()
    assert one.read_bytes().startswith(STARTS[suffix])
    assert one.read_bytes().endswith(render.ENDS[suffix])
    # Which journals refuse.
    assert b"/Type3" not in one.read_bytes()
    assert not caplog.messages
    with pytest.raises(StoreError, match="cannot be written: No such file or directory"):
        render.render(source, source.parent / "none" / one.name)


def test_legends_stay_where_they_are_above_a_foot_of_any_height(
    source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figure = Figure(figsize=(3, 2))
    legends = [
        figure.legend(handles=[Line2D([], [], label="a")], loc="upper right", **anchor)
        for anchor in ({}, {"bbox_to_anchor": (0.25, 0.5, 0, 0)})
    ]
    monkeypatch.setattr(draw, "draw", lambda _: figure)
    result = reference("fig2")
    # A dollar sign stays as it is.
    result["attributes"]["name"] = "word $a_b$ " * 150
    made = render.image(result, "png")
    [foot] = figure.texts
    lines = foot.get_text().splitlines()
    assert 55 < max(map(len, lines)) <= 65, "as long as the figure is wide"
    assert not foot.get_parse_math()
    # A tenth of an inch from the left, half as much below; PIXELS are 300.
    assert foot.get_position() == pytest.approx((0.1 / 3, -0.05 / 2))
    wide, high = struct.unpack(">II", made[16:24])
    assert max(wide, high) / 300 == pytest.approx(1, abs=0.01)
    assert high / wide * 3 == pytest.approx(2 + 0.1 + 0.11 * len(lines), abs=0.1)
    whole, part = (one.get_bbox_to_anchor().bounds for one in legends)
    width, height = figure.bbox.size
    assert whole == pytest.approx((0, 0, width, height))
    assert part == pytest.approx((width / 4, height / 2, 0, 0))
    assert legends[0].get_bbox_to_anchor() is not figure.bbox


def test_a_foot_of_digits_and_capitals_ends_on_the_page(
    source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are wider than the mean character."""
    figure = Figure(figsize=(3.6, 2))
    monkeypatch.setattr(draw, "draw", lambda _: figure)
    result = reference("fig2")
    result["attributes"]["name"] = "M_0 = $0.00862554346113913 " * 9
    render.image(result, "png")
    [foot] = figure.texts
    assert foot.get_window_extent().x1 < figure.bbox.width


@pytest.mark.slow
def test_an_image_is_drawn_once_and_again_where_it_is_half_or_that_is_asked_for(
    source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = source.with_suffix(".png")
    assert render.render(source, target)
    first = target.read_bytes()
    target.write_bytes(first + first[-12:])
    assert not render.render(source, target)
    assert render.render(source, target, force=True)
    assert target.read_bytes() == first
    target.write_bytes(first[:-7])
    for options, said in (((), "drawn"), ((), "up to date"), (("--force",), "drawn")):
        done = call(source.parent, "render", "fig2.h5", *options)
        assert done.stderr == f"fig2: fig2.png {said}\n"
    # The report takes the image that is there.
    shown = re.findall('data:image[^"]*', report.build([source])[0])
    monkeypatch.setattr(render, "image", None)
    assert re.findall('data:image[^"]*', report.build([source])[0]) == shown


def test_an_image_is_kept_that_is_whole_and_of_the_same_origin(tmp_path: Path) -> None:
    target, end = tmp_path / "x.png", render.ENDS["png"]
    for content, kept in ((b"abc" + end, True), (b"abc", False), (b"abd" + end, False)):
        target.write_bytes(content)
        assert (render.kept(target, "abc") == content) is kept


def test_what_the_certificate_beside_a_result_proves_is_drawn(
    source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = Mock(side_effect=small)
    monkeypatch.setattr(draw, "draw", drawn)
    monkeypatch.setattr(certificate_files, "beside", lambda file: f"of {file.name}")
    monkeypatch.setattr(certificate_files, "marked", lambda result, by: {**result, "by": by})
    render.render(source, source.with_suffix(".png"))
    assert drawn.call_args.args[0]["by"] == "of fig2.h5"


def test_the_fingerprint_has_all_that_an_image_depends_on(
    source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hashed, version = Mock(return_value=""), metadata.version

    def changes() -> Iterator[None]:
        yield
        # Other bytes that the same code draws.
        shutil.copy(REFERENCE / "fig1.h5", source)
        yield
        certificate_files.certificate_of(source).write_bytes(b"any")
        yield
        style = source.with_name("other.mplstyle")
        style.write_text(render.STYLE.read_text() + "font.size: 11\n")
        monkeypatch.setattr(render, "STYLE", style)
        yield
        other = {"matplotlib": "0"}
        monkeypatch.setattr(metadata, "version", lambda x: other.get(x) or version(x))
        yield
        monkeypatch.setattr(render, "code_hash_of", hashed)
        yield

    told = [[render.drawn_from(source, OF) for _ in range(2)] for _ in changes()]
    assert all(one == again for one, again in told)
    assert len({one for one, _ in told}) == 6
    files = [each.name for each in hashed.call_args.args]
    assert files == ["draw.py", "__init__.py", "captions.py"]


@pytest.mark.parametrize(
    ("error", "drawn", "shown", "code"),
    [
        (TypeError("x"), "x", "x", 4),
        (IndexError("x"), "cannot be drawn: ", "cannot be shown: .*; call: rigidpend r", 1),
    ],
)
def test_a_fault_of_the_program_is_none_of_the_file_and_values_are_a_sentence(
    source: Path, monkeypatch: pytest.MonkeyPatch, error: Any, drawn: str, shown: str, code: int
) -> None:
    assert not any(issubclass(fault, render.OF_VALUES) for fault in FAULTS)
    assert all(issubclass(fault, render.OF_VALUES) for fault in OF_VALUES)
    for name in ("draw", "tables"):
        monkeypatch.setattr(draw, name, Mock(side_effect=error))
    kind = TypeError if code == 4 else StoreError
    with pytest.raises(kind, match=drawn):
        render.render(source, source.with_suffix(".png"))
    assert call(source.parent, "render", "fig2.h5").returncode == code
    # With a picture that is there, but without numbers.
    monkeypatch.setattr(render, "kept", lambda *_: (GALLERY / "fig2.png").read_bytes())
    with pytest.raises(kind, match=shown):
        report.build([source])


@pytest.mark.usefixtures("source")
def test_an_image_has_no_more_pixels_than_can_be_made() -> None:
    """One that is higher than wide stands above."""
    assert MOST < 2**16, "the library refuses 2^16 in a direction"
    width, height = struct.unpack(">II", render.image(reference("fig2"), "png")[16:24])
    assert max(250, height) < width <= 300
