"""Monitors of wheels, steering and the ground under them, which do not rely on the wheels' data alone."""
