"""Both checkers of certificates, certificates in which something is changed, lines of logs."""

import datetime
import functools
import json
import operator
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py

from rigidpend.machine import files
from rigidpend.machine.progress import tell_nobody
from rigidpend.runs import certificates
from scripts import check_certificate

FILE = "tiny.certificate.h5"
Change = Callable[[Any], object]


def by_package(file: Path) -> str:
    """What the package refuses a certificate for; empty where it calls it proven."""
    try:
        certificates.check(file, jobs=1, report=tell_nobody)
    except files.StoreError as error:
        return str(error)
    return ""


def by_script(file: Path) -> str:
    """The same of the second checker."""
    try:
        list(check_certificate.check(file))
    except check_certificate.Refused as error:
        return str(error)
    return ""


def altered(certificate: Path, target: Path, change: Change) -> Path:
    """A copy of a certificate with a change, without its seal."""
    image = certificate.read_bytes()
    with h5py.File.in_memory(image[: image.rindex(b"\nrigidpend sha256 ")]) as file:
        change(file)
        file.flush()
        target.write_bytes(file.id.get_file_image())
    return target


def config_of(file: Any) -> Any:
    """What a certificate says that it is of."""
    return json.loads(file["config"].asstr()[()])


def restated(file: Any, config: Any) -> None:
    """Let a certificate say that it is of something."""
    file.pop("config", None)
    node = file.create_dataset("config", data=json.dumps(config))
    node.attrs.update({"units": "", "description": "resolved config, JSON"})


def stated(*place: Any, to: Any = None) -> Change:
    """Another value at a place of a certificate's config; without one there is none."""

    def change(file: Any) -> None:
        config = config_of(file)
        inner = functools.reduce(operator.getitem, place[:-1], config)
        inner[place[-1]] = to
        if to is None:
            del inner[place[-1]]
        restated(file, config)

    return change


def lines(path: Path) -> list[str]:
    """A log's lines without their times, which must be some."""
    found = [line.split(" ", 1) for line in path.read_text(encoding="utf-8").splitlines()]
    assert all(datetime.datetime.fromisoformat(time).tzinfo for time, _ in found)
    return [text for _, text in found]
