"""Configs: YAML files found by name, read with the place of every value, and checked.

Modules
-------
catalogue    configs by name; imports nothing heavy, for the shell completes names with it
names        names and paths on a command line, as files
reader       YAML with the line and column of every value
overrides    settings ``a.b=VALUE`` of the command line
schema       shared fields of the experiments' schemas
bodies       bodies with a weight or without, several in turn; the start of orbits on S1-
validation   pydantic's errors as complaints
complaints   what is wrong with a config, shown with its place
sweeps       a config for each combination of values
changes      changes from one config to another
writer       a config as YAML, each key with its meaning beside it
description  rows of name, value and meaning
theory       the theory's values for a body, as such rows
"""
