"""World of plant and devices, and its connections to the flight program."""
