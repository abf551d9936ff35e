"""Bench's end of the CAN bus."""
