"""Monitors of scanner, tilt axis, inertial sensor and clocks: devices that answer, but wrongly."""
