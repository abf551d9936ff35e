"""What is flown, and what is promised of it."""
