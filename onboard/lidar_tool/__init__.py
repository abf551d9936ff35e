"""`onboard lidar`: the flight driver alone with a scanner, for people at a bench."""
