"""Drivers of the rover's computer: clocks, real-time options, load, memory, workers, service manager."""
