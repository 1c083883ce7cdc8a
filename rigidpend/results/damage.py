"""Check of HDF5 files before they are opened: HDF5 can hang or crash on damaged metadata.

A digest shows damage, but not malice: whoever changes a file can seal it again. So each is
tried in another process first, with its time and memory bounded.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

from rigidpend.machine.files import SEAL, SEAL_LENGTH, StoreError, unsealed
from rigidpend.machine.wording import short

# Python and others warn of a fork beside threads; `tried` says why these are no matter. Once for
# all, for to change the filters for a while would change them for every thread.
warnings.filterwarnings("ignore", r".*fork\(\)", module=r"rigidpend\.results\.damage$")

SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""First bytes of an HDF5 file."""
PATIENCE = 30
"""Seconds after which another process that reads a file is taken to hang."""
ALLOWANCE, RATE = 5, 2**19
"""Seconds of the processor that reading any file may take, and bytes for each second more.

One second was too few where a tracer counts lines on a slow machine: sound files were refused.
Small objects take some 500 bytes each in a file, and 0.17 ms until its structure is found sound:
0.18 s for so many bytes."""
EACH = 4e-3
"""Seconds more for each object, once the structure is found sound.

An object takes some 0.5 ms: 0.7 s for the 1446 of a stored `stress`. Tracers, and machines that
are slow or crowded, take several times as long."""
ROOM = 2**27
"""Bytes of memory for what HDF5 itself needs."""
CANNOT = "damaged: HDF5 cannot read it"
TOO_LONG = "damaged: it takes longer to read than its size allows"


def intact(content: bytes) -> bytes:
    """The HDF5 file in a file's content; ValueError, with the reason, where that is damaged.

    What another program changed has lost its digest with the rest behind the HDF5 file. Such
    a file is taken if it is exactly as long as it says.
    """
    inner = unsealed(content)
    if inner is not None:
        return inner
    if not content.startswith(SIGNATURE):
        raise ValueError("no HDF5 signature")
    if content[-SEAL_LENGTH:].startswith(SEAL):
        raise ValueError("damaged: its digest does not match")
    if len(content) != _said_length(content):
        raise ValueError("damaged: cut short, or something was added")
    return content


def _said_length(content: bytes) -> int:
    """Length of an HDF5 file, as its superblock says."""
    version = content[8] if len(content) > 13 else 0
    size, first = (content[13:14], 24 + 4 * version) if version < 2 else (content[9:10], 12)
    width = int.from_bytes(size)
    # The address of the end of the file, the third one of the superblock in all its versions.
    return int.from_bytes(content[first + 2 * width : first + 3 * width], "little")


def tried(read: Callable[[], Any], length: int, most: int) -> None:
    """Call a function in another process, which ends when it takes too long or too much memory.

    It reads a file of `length` bytes and may need `most` bytes; a StoreError in it is what this
    process will find as well. ValueError, with the reason, where it crashed, ran out of its bounds
    or failed otherwise. Where a system cannot fork nothing is tried.
    """
    if not hasattr(os, "fork"):
        return
    out, into = os.pipe()
    said: bytes | None = b""
    # Threads are no matter: the child only reads with HDF5, whose lock Python takes at a fork.
    child = os.fork()
    # Whatever happens to the child, no code of the parent's runs in it: `_try` does not return.
    if child == 0:
        _try(read, into, seconds(length), most + ROOM)
    os.close(into)
    try:
        said = _heard(out)
    finally:
        os.close(out)
        with contextlib.suppress(ProcessLookupError):
            os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
    if said is None or (os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGXCPU):
        raise ValueError(TOO_LONG)
    if said != b"read":
        raise ValueError(said.decode(errors="replace") or CANNOT)


def seconds(length: int) -> int:
    """Processor time, in seconds, that reading a file of so many bytes may take."""
    return ALLOWANCE + length // RATE


def _heard(out: int) -> bytes | None:
    """Listen to a child until it ends; None if it hangs."""
    said, until = b"", time.monotonic() + PATIENCE
    while select.select([out], [], [], max(0.0, until - time.monotonic()))[0]:
        more = os.read(out, 4096)
        if not more:
            return said
        said += more
    return None


def _try(read: Callable[[], Any], into: int, seconds: int, memory: int) -> NoReturn:
    """The child: read within bounds, tell in a word how it went, and end."""
    said = b""
    try:
        _bound(seconds, memory)
        # A StoreError the parent will find as well, and say in its own words.
        with contextlib.suppress(StoreError):
            read()
        said = b"read"
    except (OSError, KeyError, RuntimeError, TypeError, ValueError, MemoryError) as error:
        said = (short(error).strip("'\"") or "more memory than its size allows").encode()
    # Whatever it is, saying nothing tells the parent that HDF5 cannot cope.
    except BaseException:  # noqa: BLE001
        pass
    finally:
        os.write(into, said)
        # At once: buffers and exit handlers are copies of the parent's, who runs its own.
        os._exit(0)


def grant(objects: int) -> None:
    """Give this process, a child that reads, the time that so many objects may take."""
    import resource

    with contextlib.suppress(OSError, ValueError):
        soft, hard = resource.getrlimit(resource.RLIMIT_CPU)
        resource.setrlimit(resource.RLIMIT_CPU, (soft + int(EACH * objects), hard))


def _bound(seconds: int, memory: int) -> None:
    import faulthandler
    import resource

    # A crash is an answer here, and not to be printed.
    faulthandler.disable()
    # The limit is on all memory that is mapped, and a child begins with its parent's.
    with contextlib.suppress(OSError, ValueError, FileNotFoundError):
        pages = int(Path("/proc/self/statm").read_bytes().split()[0])
        memory += pages * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    with contextlib.suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        # The soft limit, which `grant` may raise, ends it by a signal that tells why.
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + PATIENCE))
