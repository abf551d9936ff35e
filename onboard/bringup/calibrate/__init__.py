"""`onboard calibrate`: wheel radius, steering offsets, mounting of scanner and inertial sensor from a driven square."""
