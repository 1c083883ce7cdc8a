"""Configs: YAML files found by name, read with the place of every value, and checked.

Modules
-------
catalogue    files of configs by name, and the commands that make their results; imports nothing
             heavy, because shells complete by it
reader       YAML with the line and column of every value
overrides    settings ``a.b=VALUE``, and sweeps: a config for each combination of values
schema       shared fields of the experiments' schemas
bodies       bodies with a weight or without, several in turn; starts on S1-; axes of planes
validation   pydantic's errors as complaints
complaints   errors in a config, shown with their places
writer       a config as YAML, each key with its meaning; the differences of two configs
description  rows of name, value and meaning
theory       the theory's values for a body, as such rows
"""
