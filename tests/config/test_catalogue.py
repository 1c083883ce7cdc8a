"""Names of configs: where they are looked for, what they stand for, what is suggested."""

from pathlib import Path

import pytest

from rigidpend.config import catalogue
from rigidpend.config.complaints import ConfigError
from tests.config.samples import FIG4, SMALL, TEXT, written


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def said(*given: str) -> str:
    with pytest.raises(ConfigError) as caught:
        catalogue.resolve(given)
    return str(caught.value)


def test_a_config_here_goes_before_the_shipped_ones_and_adds_to_them(here: Path) -> None:
    assert catalogue.known()["fig4"].samefile(FIG4)
    measuring = here / "configs" / "measure"
    measuring.mkdir(parents=True)
    mine = {name: written(here / "configs", SMALL, f"{name}.yaml") for name in ("fig4", "mine")}
    mine["slow"] = written(measuring, SMALL, "slow.yaml")
    written(here / "configs", "no config", "notes.txt")
    known = catalogue.known()
    assert all(known[name].samefile(mine[name]) for name in mine)
    assert known["fig1"].samefile(FIG4.with_name("fig1.yaml"))
    assert "notes" not in known
    assert list(known) == sorted(known)
    # What measures the machine is meant by its name only.
    [found] = catalogue.resolve(("slow",))
    assert found.samefile(mine["slow"])
    everything = [path for path in known.values() if path.parent.name != "measure"]
    assert catalogue.resolve(("all",)) == catalogue.resolve(("all", "mine", "all")) == everything
    # Each comes once, in the order asked for, and a path goes before a name.
    assert [path.stem for path in catalogue.resolve(("mine", "fig4", "mine"))] == ["mine", "fig4"]
    paths = "configs/mine.yaml", "configs/../configs/mine.yaml", str(here / "configs/mine.yaml")
    assert catalogue.resolve(paths) == [Path(paths[0])]
    (here / "twin.yaml").symlink_to("configs/mine.yaml")
    assert len(catalogue.resolve(("configs/mine.yaml", "twin.yaml", "./twin.yaml"))) == 2
    written(here, SMALL, "fig4.yaml")
    configs = Path("configs", "fig4.yaml")
    assert catalogue.resolve(("fig4.yaml", "fig4")) == [Path("fig4.yaml"), configs]
    written(here, SMALL, "mine.yml")
    assert catalogue.resolve(("configs/../mine.yml",)) == [Path("configs/../mine.yml")]


def test_the_installed_package_s_configs_come_last_and_without_any_nothing_is_known(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = here / "site" / "rigidpend"
    monkeypatch.setattr(catalogue, "PACKAGE", package)
    assert catalogue.known() == {}
    assert "fig4: no such config" in said("fig4")
    (package / "configs").mkdir(parents=True)
    written(package / "configs", TEXT, "fig4.yaml")
    assert catalogue.resolve(("fig4",)) == [package / "configs" / "fig4.yaml"]
    (here / "configs").mkdir()
    written(here / "configs", TEXT, "fig4.yaml")
    assert catalogue.resolve(("fig4",)) == [Path("configs", "fig4.yaml")]


@pytest.mark.parametrize(
    ("name", "answer"),
    [
        *((name, "did you mean fig") for name in ("fig", "Fig4", "fg4", "fig44")),
        ("melnikov_tset", "did you mean melnikov_test?"),
        *((name, "give a FILE.yaml") for name in ("zzzzzz", "", ".", "./", "/", "..")),
    ],
)
def test_an_unknown_name_is_answered_with_a_near_one_or_with_all(
    here: Path, name: str, answer: str
) -> None:
    (here / "configs").mkdir()
    written(here / "configs", SMALL, "melnikov_test.yaml")
    assert said(name).startswith(f"{name or repr(name)}: no such config; {answer}")
    assert ("fig1, fig2" in said(name)) == (answer == "give a FILE.yaml")


def test_the_advice_comes_before_names_that_are_too_many(here: Path) -> None:
    for k in range(60):
        written(here, SMALL, f"long_name_{k}.yaml")
    advice, _, names = said("zzzzzz").partition(" or one of ")
    assert advice.endswith("give a FILE.yaml, a RESULT.h5, all")
    assert names.endswith("...")


def test_what_is_no_file_is_said(here: Path) -> None:
    (here / "folder.yaml").mkdir()
    (here / "zero.yaml").symlink_to("/dev/zero")
    told = {
        **dict.fromkeys(("absent.yaml", "a.yml", "configs/fig4.yaml"), "there is no such file"),
        "folder.yaml": "a folder, not a file",
        "zero.yaml": "not a file",
    }
    assert said(*told).splitlines() == [f"{name}: {reason}" for name, reason in told.items()]
