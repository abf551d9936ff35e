"""Live data for Foxglove over its WebSocket protocol: see `server`."""
