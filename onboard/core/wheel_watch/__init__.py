"""What the wheels, their steering and the ground under them do wrong, found without trusting the wheels alone."""
