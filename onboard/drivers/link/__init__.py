"""Drivers of the rover's end of the link: its port, keys and saved counters."""
