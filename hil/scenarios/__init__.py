"""Scenarios: their model, the promises and their judgement, the library (data/*.toml)."""
