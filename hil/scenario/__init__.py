"""Scenarios: the conditions of a run and the promises on its result."""
