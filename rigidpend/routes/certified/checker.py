"""The refusals of all checkers: a hypothesis that is not shown ends in one, never in a symbol."""


class Undecided(ArithmeticError):
    """Error: the polynomials do not prove what comes next; the text says why."""


class Outgrown(Undecided):
    """Error: the bound on the distance has grown too large; more bits would help."""
