"""Attacks on what reads files and settings: whatever they hold, one sentence and an exit code."""
