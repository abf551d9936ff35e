"""Emulated CAN nodes of the rover, the bus between them, and its sockets."""
