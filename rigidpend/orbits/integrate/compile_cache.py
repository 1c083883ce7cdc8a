"""Cache of compiled integrators: one file each, with what it is of, compared before its use.

heyoka has a cache on disk of its own, which believes what it reads: with bits flipped there, two
runs of five crashed and one had other numbers. It is off; what is kept here instead is the
integrator as a whole, which is also read faster: 5 to 14 ms where heyoka's cache took 15 to 260,
for it does the symbolic work again before it looks.
"""

from __future__ import annotations

import functools
import hashlib
import io
import pickle
import platform
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from rigidpend import __version__
from rigidpend.machine import cache

MOST = 150_000_000
"""Bytes of all kept integrators, of some 0.5 MB each; all experiments together make some 50."""
CONSTRUCTORS = ("taylor_adaptive", "taylor_adaptive_batch")
EVENTS = ("t_events", "nt_events")


def with_cache(heyoka: Any) -> Any:
    """heyoka, with its own cache on disk switched off, and constructors that use this one."""
    heyoka.llvm_state.set_diskcache_enabled(False)
    # A copy: another program in this process may use heyoka as it is.
    ours = types.ModuleType(heyoka.__name__, heyoka.__doc__)
    ours.__dict__.update(heyoka.__dict__)
    for name in CONSTRUCTORS:
        setattr(ours, name, _kept(getattr(heyoka, name), heyoka.__version__))
    return ours


def _kept(make: Callable[..., Any], version: str) -> Callable[..., Any]:
    """A constructor that compiles only what is not in the cache."""

    @functools.wraps(make)
    def made(*given: Any, **options: Any) -> Any:
        of = _followed(make.__name__, version, given, options)
        if of is None:
            return make(*given, **options)
        within = cache.folder() / "integrators"
        content = cache.load(within, of)
        if content is not None:
            return pickle.loads(content)
        integrator = make(*given, **options)
        cache.save(within, of, pickle.dumps(integrator), MOST)
        return integrator

    return made


def _followed(make: str, version: str, given: Any, options: dict[str, Any]) -> bytes | None:
    """All that an integrator follows from; None if it calls back into a program."""
    events = [event for kind in EVENTS for event in options.get(kind, ())]
    # What is called back is this program's own object, of which a cache would keep a copy.
    if options.get("nt_events") or any(event.callback is not None for event in events):
        return None
    versions = (__version__, version, platform.python_version(), processor_key())
    spelt = io.BytesIO()
    _Speller(spelt).dump((make, versions, given, sorted(options.items())))
    return spelt.getvalue()


class _Speller(pickle.Pickler):
    """A pickler that writes equal numbers alike: some have bytes that are nobody's."""

    def reducer_override(self, it: Any) -> Any:
        if isinstance(it, np.longdouble) or type(it).__name__ == "real":
            return str, (f"{it!r} in {getattr(it, 'prec', 64)} bits",)
        if hasattr(it, "cooldown"):
            said = type(it).__name__, str(it.direction), repr(it.cooldown)
            return tuple, ([*said, it.expression],)
        return NotImplemented


@functools.cache
def processor_key() -> str:
    """A short name for this processor's model and instruction set, for which code is compiled."""
    return hashlib.sha256(_processor().encode()).hexdigest()[:16]


def processor_model() -> str:
    """The processor's name, as far as the system tells it."""
    for line in _processor().splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _processor() -> str:
    """Identity of the processor: its model and flags where Linux tells them."""
    try:
        first, _, _ = Path("/proc/cpuinfo").read_text().partition("\n\n")
    except OSError:
        return f"{platform.machine()} {platform.processor()}"
    kept = ("model name", "flags", "Features", "CPU part", "CPU implementer")
    return "\n".join(line for line in first.splitlines() if line.startswith(kept))
