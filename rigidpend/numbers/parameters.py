"""Errors of values: a number that cannot be read, a parameter that its conditions exclude."""

from __future__ import annotations


class ExactError(ValueError):
    """A value that is no finite real number, or a text that is no expression of one."""


class ParameterError(ValueError):
    """A parameter that its conditions exclude; the message names condition and values."""

    def __init__(self, field: str, message: str) -> None:
        # Both, for an error that comes from a worker is made again from its arguments.
        super().__init__(field, message)
        self.field = field
        """The name of the parameter that is wrong."""

    def __str__(self) -> str:
        return str(self.args[1])
