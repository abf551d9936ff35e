"""Bridges to other ground systems: CCSDS space packets of what the station hears, telecommand packets into requests."""
