"""What the daemon tells of itself to who asks on the same machine."""
