"""Configs: YAML files found by name, read with the place of every value, and checked."""
