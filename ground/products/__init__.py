"""What the rover sends as files: written as other tools open them, and what its planner would answer on its map."""
