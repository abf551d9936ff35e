"""Session with the scanner, without I/O: requests, checks, clock and scans."""
