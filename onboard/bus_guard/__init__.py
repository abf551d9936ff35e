"""A process of its own that watches what the computer orders on the bus and can do one thing: stop the rover."""
