"""The session on a real link: settings, keys, clock, saved counters."""
