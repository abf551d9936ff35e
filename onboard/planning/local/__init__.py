"""Local planning on the rover's own map: free poses, cost-to-go, planners behind one contract, drivable paths."""
