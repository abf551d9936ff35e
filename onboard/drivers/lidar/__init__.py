"""Drivers of the scanner's port: TCP, USB, serial line."""
