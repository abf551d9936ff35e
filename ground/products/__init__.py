"""Products of the rover as files for other tools, and the preview of a goto by the rover's own planner."""
