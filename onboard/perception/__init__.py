"""From beams to a map that knows what it does not know."""
