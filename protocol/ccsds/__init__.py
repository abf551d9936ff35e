"""CCSDS packets of telemetry and commands, and their XTCE description."""
