"""From a path to steering angles and wheel rates, and back to odometry."""
