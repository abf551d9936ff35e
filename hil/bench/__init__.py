"""Plant and devices in one world, and how the flight program is joined to it."""
