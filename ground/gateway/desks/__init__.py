"""Requests of the gateway's clients: commands, modes, missions and parameters, each answered once."""
