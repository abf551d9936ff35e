"""Device sessions of the rover, sans-I/O: bytes and frames in, records out, commands back."""
