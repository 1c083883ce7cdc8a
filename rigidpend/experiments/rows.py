"""Rows of descriptions, under the name by which they were known; see `rigidpend.description`."""

from rigidpend.description import body_rows as body_rows
