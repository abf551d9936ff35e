"""The bench's side of the scanner's cable."""
