"""Check of HDF5 files before they are opened: HDF5 can hang or crash on damaged metadata.

A digest reveals damage, but not malice: whoever changes a file can seal it again. So each file
is first read in another process, with bounded time and memory.
"""

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

# Python warns of a fork in a process with threads; `tried` says why threads do no harm here. The
# filter is permanent, because changing filters for a while would change them for every thread.
warnings.filterwarnings("ignore", r".*fork\(\)", module=r"rigidpend\.results\.damage$")

SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""First bytes of an HDF5 file."""
PATIENCE = 30
"""Seconds after which another process that reads a file is assumed to hang."""
ALLOWANCE, RATE = 5, 2**18
"""Seconds of processor time that reading any file may take, and bytes for each further second.

One second was too few for a tracer that counts lines on a slow machine: sound files were refused.
A file of small objects takes longest: of a stored `bench` `RATE` bytes take 0.2 s. Tracers, and
slow or crowded machines, take several times as long."""
ROOM = 2**27
"""Bytes of memory for what HDF5 itself needs."""
CANNOT = "damaged: HDF5 cannot read it"
TOO_LONG = "damaged: it takes longer to read than its size allows"


def intact(content: bytes) -> bytes:
    """The HDF5 part of a file's content; ValueError, with the reason, if it is damaged.

    Another program that changes a file cuts off the digest, which stands behind the HDF5 part.
    Such a file is accepted if it is exactly as long as its superblock says.
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
    """Length of an HDF5 file according to its superblock."""
    version = content[8] if len(content) > 13 else 0
    size, first = (content[13:14], 24 + 4 * version) if version < 2 else (content[9:10], 12)
    width = int.from_bytes(size)
    # In all versions the third address of the superblock is the end of the file.
    return int.from_bytes(content[first + 2 * width : first + 3 * width], "little")


def tried(read: Callable[[], Any], length: int, memory: int) -> None:
    """Call a function in another process, which ends if it takes too much time or memory.

    The function reads a file of `length` bytes and may need `memory` bytes; a StoreError in it is
    ignored, because this process will raise it too. ValueError, with the reason, if it crashed,
    exceeded its bounds or failed otherwise. On systems without fork nothing is tried.
    """
    if not hasattr(os, "fork"):
        return
    out, into = os.pipe()
    said: bytes | None = b""
    # Threads do no harm: the child only reads with HDF5, whose lock h5py holds during a fork.
    child = os.fork()
    # The child never runs further code of the parent: `_try` does not return.
    if child == 0:
        _try(read, into, seconds(length), memory + ROOM)
    os.close(into)
    try:
        said = _heard(out)
    finally:
        os.close(out)
        with contextlib.suppress(ProcessLookupError):
            # Killed in any case, so that waiting for it cannot hang.
            os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
    if said is None or (os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGXCPU):
        raise ValueError(TOO_LONG)
    if said != b"read":
        raise ValueError(said.decode(errors="replace") or CANNOT)


def seconds(length: int) -> int:
    """Processor time, in seconds, that reading a file of `length` bytes may take."""
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
    """The child process: read within bounds, send a word on the outcome, and end."""
    said = b""
    try:
        _bound(seconds, memory)
        # The parent will meet a StoreError too, and report it.
        with contextlib.suppress(StoreError):
            read()
        said = b"read"
    except (OSError, KeyError, RuntimeError, TypeError, ValueError, MemoryError) as error:
        said = (short(error).strip("'\"") or "more memory than its size allows").encode()
    # The child sends nothing: the parent concludes that HDF5 cannot read the file.
    except BaseException:  # noqa: BLE001
        pass
    finally:
        os.write(into, said)
        # At once, because buffers and exit handlers are copies of the parent's, which runs its own.
        os._exit(0)


def _bound(seconds: int, memory: int) -> None:
    import faulthandler
    import resource

    # A crash is a valid outcome here, whose traceback must not be printed.
    faulthandler.disable()
    # The limit counts all mapped memory, and a child begins with its parent's.
    with contextlib.suppress(OSError, ValueError, FileNotFoundError):
        pages = int(Path("/proc/self/statm").read_bytes().split()[0])
        memory += pages * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    with contextlib.suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        # The soft limit ends the child by a signal that names the reason.
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + PATIENCE))
