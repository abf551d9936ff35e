"""Twins of the rover's devices: what onboard talks to, emulated byte by byte."""
