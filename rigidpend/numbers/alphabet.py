"""The symbols of route codes as numbers, for what computes them as well as for what draws them."""

NO_SYMBOL = 255
"""The code where there is no symbol: the orbit does not cross J1 = J2/2 again."""
