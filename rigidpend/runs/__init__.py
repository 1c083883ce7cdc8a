"""Runs of experiments: plans, workers, progress, logs, checkpoints, provenance."""
