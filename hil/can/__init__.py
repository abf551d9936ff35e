"""The bench's side of the CAN bus."""
