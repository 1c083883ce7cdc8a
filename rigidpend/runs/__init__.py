"""Runs of experiments: plans, workers, progress, logs, checkpoints, provenance.

Modules
-------
loading     a checked config from a file
runner      from configs to result files; a result that is up to date is not computed again
parts       checkpoints: an interrupted run continues from its finished parts
provenance  the origin of a result: versions, commit, machine, code
logs        progress and errors, stored beside the results
cluster     parts computed by a Dask cluster
references  stored results that fresh ones are compared with
certificates  certificates of whole configs, stored while they are made
certificate_files  certificates as files
orbit_proofs  proofs that an orbit has a code, as files
"""
