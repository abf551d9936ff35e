"""The orbiter's map (GDEM) as a file: reader and writer, with checks."""
