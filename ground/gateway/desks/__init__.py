"""What clients of the gateway ask for: commands, modes, missions and parameters, each answered once."""
