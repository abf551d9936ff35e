"""Fault monitors: the rows of protocol.tables.faults, computed from the data of each tick."""
