"""Configs: YAML files found by name, read with the place of every value, and checked.

Modules
-------
catalogue    names of configs, as files; imports nothing heavy, for shells complete by it
reader       YAML with the line and column of every value
overrides    settings ``a.b=VALUE``, and sweeps: a config for each combination of values
schema       shared fields of the experiments' schemas
bodies       bodies with a weight or without, several in turn; starts on S1-; axes of planes
validation   pydantic's errors as complaints
complaints   what is wrong with a config, shown with its place
writer       a config as YAML, each key with its meaning beside it; what differs in two
description  rows of name, value and meaning
theory       the theory's values for a body, as such rows
"""
