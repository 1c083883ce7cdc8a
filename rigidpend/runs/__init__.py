"""Runs of experiments: plans, workers, progress, logs, checkpoints, provenance.

Modules
-------
loading     a checked config from a file
runner      from configs to result files; what is up to date is left alone
parts       checkpoints: an interrupted run goes on from its finished parts
provenance  what a result was made from: versions, commit, machine, code
logs        progress and errors kept beside the results
cluster     parts computed by a Dask cluster
regression  results against stored references
certificates  certificates of whole configs, kept while they are made
certificate_files  certificates as files
"""
