"""Casters of the scanner's rays."""
