"""What scanner, tilt axis, inertial sensor and clocks do wrong although they answer."""
