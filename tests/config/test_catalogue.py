"""Names of configs: where they are looked for, what they stand for, what is suggested."""

from __future__ import annotations

from pathlib import Path

import pytest

from rigidpend.config import catalogue
from rigidpend.runs.loading import ConfigError
from tests.config.samples import FIG4, SMALL, TEXT, written


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def configs(here: Path) -> Path:
    """The folder configs/ of the working directory."""
    folder = here / "configs"
    folder.mkdir()
    return folder


def said(*given: str) -> str:
    with pytest.raises(ConfigError) as caught:
        catalogue.resolve(given)
    return str(caught.value)


def test_the_shipped_configs_are_found_from_anywhere(here: Path) -> None:
    assert catalogue.known()["fig4"].samefile(FIG4)
    [found] = catalogue.resolve(("fig4",))
    assert found.samefile(FIG4)


def test_a_config_here_goes_before_the_shipped_one(configs: Path) -> None:
    written(configs, TEXT, "fig4.yaml")
    [found] = catalogue.resolve(("fig4",))
    assert found.samefile(configs / "fig4.yaml")
    assert not found.samefile(FIG4)


def test_a_config_here_adds_to_the_shipped_ones(configs: Path) -> None:
    written(configs, SMALL, "mine.yaml")
    written(configs, "no config", "notes.txt")
    known = catalogue.known()
    assert known["mine"].samefile(configs / "mine.yaml")
    assert known["fig4"].samefile(FIG4)
    assert "notes" not in known
    assert list(known) == sorted(known)


def test_the_installed_package_s_configs_come_last(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = here / "site" / "rigidpend"
    (package / "configs").mkdir(parents=True)
    written(package / "configs", TEXT, "fig4.yaml")
    monkeypatch.setattr(catalogue, "PACKAGE", package)
    assert catalogue.resolve(("fig4",)) == [package / "configs" / "fig4.yaml"]
    (here / "configs").mkdir()
    written(here / "configs", TEXT, "fig4.yaml")
    assert catalogue.resolve(("fig4",)) == [Path("configs", "fig4.yaml")]


def test_without_any_folder_nothing_is_known(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(catalogue, "PACKAGE", here / "site" / "rigidpend")
    assert catalogue.known() == {}
    assert "fig4: no such config" in said("fig4")


@pytest.mark.parametrize("name", ["mine.yaml", "./mine.yaml", "sub/../mine.yaml", "mine.yml"])
def test_a_path_is_taken_as_it_is(here: Path, name: str) -> None:
    (here / "sub").mkdir()
    written(here, SMALL, Path(name).name)
    assert catalogue.resolve((name,)) == [Path(name)]


def test_a_path_goes_before_a_name(configs: Path) -> None:
    mine, other = written(configs.parent, SMALL, "fig4.yaml"), written(configs, TEXT, "fig4.yaml")
    assert catalogue.resolve(("fig4.yaml", "fig4")) == [
        mine.relative_to(configs.parent),
        other.relative_to(configs.parent),
    ]


def test_each_file_comes_once_in_the_order_asked_for_and_all_is_every_known_one(
    configs: Path,
) -> None:
    written(configs, SMALL, "mine.yaml")
    everything = list(filter(catalogue.in_all, catalogue.known().values()))
    assert catalogue.resolve(("all",)) == catalogue.resolve(("all", "mine", "all")) == everything
    assert [path.stem for path in catalogue.resolve(("mine", "fig4", "mine"))] == ["mine", "fig4"]


@pytest.mark.parametrize(
    ("name", "answer"),
    [
        *((name, "did you mean fig") for name in ("fig", "Fig4", "fg4", "fig44")),
        ("melnikov_tset", "did you mean melnikov_test?"),
        ("zzzzzz", "known are "),
    ],
)
def test_an_unknown_name_is_answered_with_a_near_one_or_with_all(
    configs: Path, name: str, answer: str
) -> None:
    written(configs, SMALL, "melnikov_test.yaml")
    assert said(name).startswith(f"{name}: no such config; {answer}")
    assert ("fig1, fig2" in said(name)) == (name == "zzzzzz")


@pytest.mark.parametrize("name", ["absent.yaml", "absent.yml", "configs/fig4.yaml"])
def test_a_path_that_is_not_there_is_said(here: Path, name: str) -> None:
    assert said(name) == f"{name}: there is no such file"


def test_what_measures_the_machine_is_meant_by_its_name_only(configs: Path) -> None:
    (configs / "measure").mkdir()
    slow = written(configs / "measure", SMALL, "slow.yaml")
    assert catalogue.known()["slow"].samefile(slow)
    assert not any(path.name == "slow.yaml" for path in catalogue.resolve(("all",)))
    [found] = catalogue.resolve(("slow",))
    assert found.samefile(slow)


def test_a_folder_or_a_device_is_not_a_file(here: Path) -> None:
    (here / "folder.yaml").mkdir()
    (here / "zero.yaml").symlink_to("/dev/zero")
    assert (
        said("folder.yaml", "zero.yaml")
        == "folder.yaml: a folder, not a file\nzero.yaml: not a file"
    )
