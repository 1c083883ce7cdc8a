"""Runs of experiments: plans, workers, progress, logs, checkpoints, provenance.

Modules
-------
runner      from configs to result files; what is up to date is left alone
parts       checkpoints: an interrupted run goes on from its finished parts
provenance  what a result was made from: versions, commit, machine, code
code_cache  what was read in source files, kept on disk
progress    progress display on a terminal
logs        progress and errors kept beside the results
workers     threads and processes side by side
signals     signal handling (SIGTERM, SIGINT)
"""
