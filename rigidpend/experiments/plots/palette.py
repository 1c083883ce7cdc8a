"""Colours and page width of all figures: Okabe and Ito's palette, safe for the colour-blind.

Source of the palette: M. Okabe and K. Ito, Color Universal Design, 2008.
"""

from __future__ import annotations

WIDTH = 7.2
"""Width of a page, inches."""

BLUE, RED, GREEN = "#0072B2", "#D55E00", "#009E73"
PINK, ORANGE, SKY = "#CC79A7", "#E69F00", "#56B4E9"

SEPARATRIX = {1: GREEN, 2: BLUE, 3: PINK, 4: RED}
"""Colour of each separatrix."""
