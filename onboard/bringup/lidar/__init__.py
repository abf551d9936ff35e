"""`onboard lidar`: the flight driver and a scanner without the flight program, for people at a bench."""
