"""Modes of the rover: executive, control lease, orders of the operators, sequences."""
