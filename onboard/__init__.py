"""Flight program of a four-wheel-steered rover."""
