"""Emulated devices of the rover: byte-exact counterparts of the devices that onboard talks to."""
