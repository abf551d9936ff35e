"""The station's archive, one SQLite file: written turn by turn, read by time and name, kept within bounds, exported."""
