"""Perception: from LIDAR beams to a map in which unknown cells are marked as unknown."""
