"""Emulated Hokuyo scanner: the sensor without I/O, its profiles, faults, cables and command."""
