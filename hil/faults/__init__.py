"""What a scenario can break, by tables."""
