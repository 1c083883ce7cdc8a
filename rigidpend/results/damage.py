"""Which HDF5 files are safe to open: HDF5 itself can hang or crash on damaged metadata."""

from __future__ import annotations

import contextlib
import functools
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py

from rigidpend.results.files import SEAL, SEAL_LENGTH, unsealed

SIGNATURE = b"\x89HDF\r\n\x1a\n"
PATIENCE = 30
"""Seconds after which another process that reads a file is taken to hang."""


def undamaged(content: bytes) -> bytes:
    """The HDF5 file in a file's content, if it is safe to open.

    What another program changed has lost its digest with the rest behind the HDF5 file. Such
    a file, exactly as long as it says, is opened if another process survived doing so.

    Raises
    ------
    ValueError
        It is not, with the reason.
    """
    inner = unsealed(content)
    if inner is not None:
        return inner
    if not content.startswith(SIGNATURE):
        raise ValueError("no HDF5 signature")
    if content[-SEAL_LENGTH:].startswith(SEAL):
        raise ValueError("damaged: its digest does not fit")
    if len(content) != _said_length(content):
        raise ValueError("damaged: cut short, or something was added")
    if not _survived(content):
        raise ValueError("damaged: HDF5 cannot cope with it")
    return content


def _said_length(content: bytes) -> int:
    """How long an HDF5 file says that it is, in its superblock."""
    version = content[8] if len(content) > 13 else 0
    size, first = (content[13:14], 24 + 4 * version) if version < 2 else (content[9:10], 12)
    width = int.from_bytes(size)
    return int.from_bytes(content[first + 2 * width : first + 3 * width], "little")


@functools.lru_cache(maxsize=8)
def _survived(content: bytes) -> bool:
    """Whether another process could read all of an HDF5 file, or found words for what is wrong."""
    package = str(Path(__file__).resolve().parents[2])
    try:
        done = subprocess.run(
            [sys.executable, "-P", "-c", f"from {__name__} import _try; _try()"],
            input=content,
            env={**os.environ, "PYTHONPATH": package},
            capture_output=True,
            timeout=PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def _try() -> None:
    """Read the HDF5 file on stdin, in bounded memory."""
    content = sys.stdin.buffer.read()
    with contextlib.suppress(ImportError):
        import resource

        most = 2**31 + 100 * len(content)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
    with (
        contextlib.suppress(OSError, KeyError, RuntimeError, TypeError, ValueError),
        h5py.File.in_memory(content) as file,
    ):
        file.visititems(_look)


def _look(_: str, node: Any) -> None:
    """Read all of an object."""
    dict(node.attrs)
    if isinstance(node, h5py.Dataset):
        node[()]
