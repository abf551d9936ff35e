"""Bench's end of the scanner's cable."""
