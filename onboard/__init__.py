"""The flight program of a four-wheel-steered rover."""
