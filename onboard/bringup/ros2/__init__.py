"""Export of a record as a ROS 2 bag (MCAP), for the tools of ROS: see `bag`."""
