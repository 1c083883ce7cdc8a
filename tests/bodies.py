"""The bodies of the paper's figures, and one that is special in nothing."""

from __future__ import annotations

from rigidpend import Body

FREE = Body(A=(2, 1, "1.5"), r=(1, 1, 0), mu=0)
"""Of Fig. 1."""
FIG4 = Body(A=(2, 1, "1.5"), r=(1, 1, 0), mu="0.001")
GENERIC = Body(A=(2, "1.2", "1.7"), r=(1, 3, 0), mu="0.004")
