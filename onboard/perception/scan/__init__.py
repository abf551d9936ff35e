"""Scan: sweep of the scanner, tilt of each beam, points, and the beams that returned nothing."""
