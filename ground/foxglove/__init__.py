"""Live view for Foxglove: see `server`."""
