"""What routes ask of the integrator."""

from typing import Any

import pytest

from rigidpend.orbits import integrate


@pytest.fixture
def integrations(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """Each integration from now on: how many `orbits` it has, their `limit`, and the numerics."""
    seen: list[dict[str, Any]] = []
    real = integrate.crossings

    def noting(orbits: Any, **numerics: Any) -> Any:
        n, limit = orbits.states.shape[1], orbits.passage_limit
        seen.append({"orbits": n, "limit": limit, **numerics})
        return real(orbits, **numerics)

    monkeypatch.setattr(integrate, "crossings", noting)
    return seen
