"""The picture of a run, live or afterwards, by a process that reads what the run writes; the run never hears of it."""
