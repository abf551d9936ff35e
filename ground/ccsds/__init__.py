"""Bridges to other ground systems: CCSDS telemetry from the session's news, telecommands into requests."""
