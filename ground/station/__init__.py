"""The session on a real link: settings, keys, clock, the memory of counters."""
