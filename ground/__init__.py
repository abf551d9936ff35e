"""The ground station. Each folder imports only the folders below it; the import contract in pyproject.toml checks this.

__main__                     the command `ground`
watch                        the view in the terminal
shell   gateway   bridge     many verbs on one link; MAVLink ground programs; CCSDS ground systems
foxglove                     live data for Foxglove by WebSocket, read-only
verbs                        the command line: requests to the rover and queries of the archive
operation                    one operation from start to exit code: a script in, news out
station products report      the link with keys, clock and saved state; products as files; a mission as one page
archive                      everything sent and received, in one SQLite file
session                      the link's end without I/O: requests, telemetry, contact, the rover's time
"""
