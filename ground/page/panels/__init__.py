"""Panels of the page, as elements of its library."""
