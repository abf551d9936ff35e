"""Who casts the scanner's rays."""
