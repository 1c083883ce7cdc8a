"""Notebooks: results with labels, computed in a line, drawn; orbits; tables with values by name."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import rigidpend
from docs import notebooks
from rigidpend.machine import files
from rigidpend.results import store
from rigidpend.routes.herpolhode import SampledOrbit
from tests.bodies import FIG4
from tests.cli.calls import REFERENCE
from tests.config.samples import SMALL, changed, written

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("notebook")
    return rigidpend.run(written(folder, SMALL, "small.yaml"), mu="0.01", folder=folder)


@pytest.mark.slow
def test_a_run_is_named_by_what_is_set_and_done_once(result: Any) -> None:
    assert result.path.name == "small_mu=0.01.h5"
    assert result.config["problem"]["mu"] == "1/100"
    said: list[str] = []
    again = rigidpend.run(
        result.path.with_name("small.yaml"),
        mu=0.01,
        folder=result.path.parent,
        progress=said.append,
    )
    assert (again.path, said) == (result.path, [])
    more = rigidpend.run(
        result.path,
        {"numerics.precisions": [53, 64]},
        called="more",
        folder=result.path.parent,
        progress=said.append,
    )
    assert more.path == result.path.with_name("more.h5")
    assert said[-1].startswith("more: ")


@pytest.mark.slow
def test_arrays_have_their_dimensions_units_and_coordinates(result: Any) -> None:
    codes = result["only"]["codes"]
    assert codes.dims == ("symbols", "columns")
    assert codes.attrs["units"] == "1"
    assert "row 0 = symbol 1" in codes.attrs["description"]
    np.testing.assert_allclose(codes.coords["theta2_0"], [1, 1.1, 1.2, 1.3, 1.4])
    assert codes.coords["theta2_0"].attrs["units"] == "rad"
    with pytest.raises(KeyError, match="known: only"):
        result["onyl"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["fig3", "fig4_zoom", "asymptotic_orbits"])
def test_every_stored_array_is_in_the_tree(name: str) -> None:
    """Of groups of one kind, of several and inside each other."""
    loaded = rigidpend.load(REFERENCE / f"{name}.h5")
    arrays = list(pairs(loaded.data, loaded.values))
    assert len(arrays) >= 7
    for node, values in arrays:
        np.testing.assert_array_equal(node.values, np.asarray(values))
        assert {"units", "description"} <= node.attrs.keys()


def pairs(node: Any, values: Any) -> Iterator[tuple[Any, Any]]:
    """Arrays of a tree with what is stored of each."""
    if not isinstance(values, dict):
        yield node, values
        return
    for key, value in values.items():
        yield from pairs(node[key], value)


def test_the_file_itself_has_named_dimensions_with_scales(result: Any) -> None:
    with h5py.File(result.path) as file:
        codes = file["data/only/codes"]
        assert [dimension.label for dimension in codes.dims] == ["symbols", "columns"]
        assert [list(dimension) for dimension in codes.dims] == [[], ["theta2_0"]]
        assert codes.dims[1]["theta2_0"] == file["data/only/theta2_0"]
    # They are no part of what is compared, and a result with them is read like any other.
    assert "DIMENSION_LIST" not in store.load_outlined(result.path)[1]["/data/only/codes"]
    assert set(store.load(result.path)["data"]) == {"only"}


def test_a_figure_is_drawn(result: Any) -> None:
    figure = rigidpend.plot(result)
    assert [axes.get_title("left") for axes in figure.axes] == ["only array"]
    assert rigidpend.plot(result.path).get_size_inches().tolist() > [1, 1]


def test_an_orbit_has_its_angles_and_its_hodograph() -> None:
    reference = store.load(REFERENCE / "fig5.h5")["data"]["case1"]
    body = rigidpend.Body(A=(2, "1.5", "1.8"), r=(0, 1, 0), mu="0.01")
    made: SampledOrbit = rigidpend.orbit(
        body, "1.02", h0="10/9", J1_0="2.39205e-9", time=30.0, step=float(reference["t"][1])
    )
    n = made.t.size
    # The last sample is at the time that was asked for, the others a step apart.
    assert made.t[-2] < made.t[-1] == 30.0 <= made.t[-2] + made.t[1]
    for name in ("t", "theta1", "J1_over_J2", "theta3", "alpha", "omega"):
        stored = reference[name][: n - 1]
        np.testing.assert_allclose(getattr(made, name)[:-1], stored, atol=1e-6, err_msg=name)
    assert repr(made) == f"<orbit of {n} samples, t' = 0 to {made.t[-1]:.6g}>"
    with pytest.raises(ValueError, match="jobs must be a whole number from 1 on, got 0"):
        rigidpend.run("fig4", jobs=0)


def test_a_table_finds_its_values_by_name() -> None:
    table = rigidpend.theory(FIG4, "1.3342", "1e-8")
    assert table["alpha0"] == 1.9106332362490186
    assert table["regime"] == "iv"
    with pytest.raises(KeyError, match="known: A, r, mu"):
        table["beta"]
    assert all(len(line) <= 100 for line in repr(table).splitlines())
    assert "<td>1.9106332362490186</td>" in table._repr_html_()


@pytest.mark.slow
def test_what_is_shown_is_short_and_safe(result: Any, tmp_path: Path) -> None:
    said = "<route_codes 'small_mu=0.01'; A = (2, 1, 1.5), r along (1, 1, 0), mu = 0.01,"
    assert repr(result).startswith(said)
    assert len(repr(result)) < 200
    only = result.values["only"]
    assert result.words == {"only": ["".join(map(str, column)) for column in only["codes"].T]}
    named = written(tmp_path, changed("only:", "script:", SMALL), "other.yaml")
    shown = rigidpend.run(named, folder=tmp_path, called="a")._repr_html_()
    assert "<b>a</b>" in shown
    assert "<script" not in shown


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("all",), r"^all names \d\d configs: give one of them"),
        (
            ("fig4", {"problem.arrays": {"x": {"start": 0}}}),
            "^the values make no name: give one as",
        ),
        # A word that is no key is not said to be an option.
        (("fig4", {"problem.muu": 1}), r"^problem\.muu=1: problem\.muu: unknown key"),
        (("fig4", {7: 1}), "7=1: 7: unknown key"),
    ],
)
def test_what_is_wrong_with_a_run_is_said(tmp_path: Path, given: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        rigidpend.run(*given, folder=tmp_path)
    with pytest.raises(ValueError, match=r"^called: a name is made of"):
        rigidpend.run("fig4", mu=0.01, called="a/b", folder=tmp_path)


@pytest.mark.parametrize(
    ("taken", "folder", "said"),
    [
        ("a", "a", r"choose another folder as `folder`$"),
        ("FIG2.h5", ".", r"choose another as `called`$"),
        ("fig2.h5", ".", r"move it away, or remove it$"),
    ],
)
def test_what_is_in_the_way_is_told_with_arguments_not_with_options(
    tmp_path: Path, taken: str, folder: str, said: str
) -> None:
    written(tmp_path, "", taken)
    with pytest.raises(files.StoreError, match=said):
        rigidpend.run("fig2", folder=tmp_path / folder)


@pytest.mark.parametrize(
    ("name", "said"),
    [("none", "there is no such file"), ("fig4", "; call: rigidpend run fig4 --")],
)
def test_a_result_that_is_not_there_is_said(tmp_path: Path, name: str, said: str) -> None:
    with pytest.raises(files.StoreError, match=said):
        rigidpend.load(tmp_path / f"{name}.h5")


@pytest.mark.slow
def test_every_cell_of_the_notebooks_runs_and_is_shown_with_its_outcome(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    tour, codes = (
        notebooks.page(ROOT / "docs" / f"{name}.ipynb", tmp_path) for name in ("notebook", "codes")
    )
    assert (tmp_path / "results" / "fig4_mu=0.01.h5").is_file()
    assert (tmp_path / "notebook-1.png").read_bytes().startswith(b"\x89PNG")
    assert "![](notebook-1.png)" in tour
    # What is found has the code that it was found by.
    assert tour.count("```python") >= 6
    assert "['0001101']" in codes
    assert "(['proven'], ['0100'])" in codes
