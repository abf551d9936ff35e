"""Status report of the daemon, for callers on the same machine."""
