"""Ways to run a scenario: over sockets in lock-step, in one process, with real hardware."""
