"""What the rover talks to, sans-I/O: bytes and frames in, records out, commands back."""
