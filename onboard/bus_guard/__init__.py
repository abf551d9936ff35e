"""Bus guard: a separate process that monitors the computer's orders on the bus and can only stop the rover."""
