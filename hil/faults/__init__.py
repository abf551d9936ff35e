"""Fault injection: tables of the faults that a scenario can inject."""
