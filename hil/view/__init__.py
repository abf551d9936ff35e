"""Viewer of a run, live or afterwards: a separate process that reads the run's files and does not affect the run."""
