"""Names of configs: where they are looked for, what they stand for, what is suggested."""

from __future__ import annotations

from pathlib import Path

import pytest

from rigidpend.config import catalogue, names
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
        names.resolve(given)
    return str(caught.value)


def test_the_shipped_configs_are_found_from_anywhere(here: Path) -> None:
    assert names.known()["fig4"].samefile(FIG4)
    [found] = names.resolve(("fig4",))
    assert found.samefile(FIG4)


def test_a_config_here_goes_before_the_shipped_one(configs: Path) -> None:
    written(configs, TEXT, "fig4.yaml")
    [found] = names.resolve(("fig4",))
    assert found.samefile(configs / "fig4.yaml")
    assert not found.samefile(FIG4)


def test_a_config_here_adds_to_the_shipped_ones(configs: Path) -> None:
    written(configs, SMALL, "mine.yaml")
    written(configs, "no config", "notes.txt")
    known = names.known()
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
    assert names.resolve(("fig4",)) == [package / "configs" / "fig4.yaml"]
    (here / "configs").mkdir()
    written(here / "configs", TEXT, "fig4.yaml")
    assert names.resolve(("fig4",)) == [Path("configs", "fig4.yaml")]


def test_without_any_folder_nothing_is_known(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(catalogue, "PACKAGE", here / "site" / "rigidpend")
    assert names.known() == {}
    assert "fig4: no such config" in said("fig4")


@pytest.mark.parametrize("name", ["mine.yaml", "./mine.yaml", "sub/../mine.yaml", "mine.yml"])
def test_a_path_is_taken_as_it_is(here: Path, name: str) -> None:
    (here / "sub").mkdir()
    written(here, SMALL, Path(name).name)
    assert names.resolve((name,)) == [Path(name)]


def test_a_path_goes_before_a_name(configs: Path) -> None:
    mine, other = written(configs.parent, SMALL, "fig4.yaml"), written(configs, TEXT, "fig4.yaml")
    assert names.resolve(("fig4.yaml", "fig4")) == [
        mine.relative_to(configs.parent),
        other.relative_to(configs.parent),
    ]


def test_all_is_every_known_config_once(configs: Path) -> None:
    written(configs, SMALL, "mine.yaml")
    everything = list(filter(catalogue.in_all, names.known().values()))
    assert names.resolve(("all",)) == everything
    assert names.resolve(("all", "mine", "all")) == everything


def test_each_file_comes_once_in_the_order_asked_for(configs: Path) -> None:
    written(configs, SMALL, "mine.yaml")
    found = names.resolve(("mine", "fig4", "mine"))
    assert [path.stem for path in found] == ["mine", "fig4"]


@pytest.mark.parametrize("name", ["fig", "Fig4", "fg4", "fig44"])
def test_an_unknown_name_is_answered_with_a_near_one(here: Path, name: str) -> None:
    assert said(name).startswith(f"{name}: no such config; did you mean fig")


def test_a_name_like_no_other_is_answered_with_all(here: Path) -> None:
    text = said("zzzzzz")
    assert text.startswith("zzzzzz: no such config; known are ")
    assert "fig4" in text


def test_a_suggestion_may_be_a_config_here(configs: Path) -> None:
    written(configs, SMALL, "melnikov_test.yaml")
    assert said("melnikov_tset") == ("melnikov_tset: no such config; did you mean melnikov_test?")


@pytest.mark.parametrize("name", ["absent.yaml", "absent.yml", "configs/fig4.yaml"])
def test_a_path_that_is_not_there_is_said(here: Path, name: str) -> None:
    assert said(name) == f"{name}: there is no such file"


def test_what_measures_the_machine_is_meant_by_its_name_only(configs: Path) -> None:
    (configs / "measure").mkdir()
    slow = written(configs / "measure", SMALL, "slow.yaml")
    assert names.known()["slow"].samefile(slow)
    assert not any(path.name == "slow.yaml" for path in names.resolve(("all",)))
    [found] = names.resolve(("slow",))
    assert found.samefile(slow)


def test_a_folder_or_a_device_is_not_a_file(here: Path) -> None:
    (here / "folder.yaml").mkdir()
    (here / "zero.yaml").symlink_to("/dev/zero")
    assert said("folder.yaml", "zero.yaml") == "folder.yaml: not a file\nzero.yaml: not a file"
