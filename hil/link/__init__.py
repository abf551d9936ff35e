"""The bad link between rover and ground."""
