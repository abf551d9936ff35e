"""Emulated lossy link between rover and ground."""
