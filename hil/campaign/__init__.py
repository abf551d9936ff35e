"""Campaigns: many flights with drawn conditions, their table, its statistics, and the comparison of two tables.

PLAN.toml -> plan: distributions -> case: drawn values -> scenario, ground, rover
case -> flight_process (one process, renewed) <- cluster (dask.distributed) <- command
rows -> table (append-safe, then Parquet) -> statistics -> report
                                          -> compare
"""
