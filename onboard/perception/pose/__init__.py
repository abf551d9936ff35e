"""Pose: attitude, filter and localisation on the move, registration of a scan at a stop."""
