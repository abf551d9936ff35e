"""The ground station. Each folder imports only the folders below it; the import contract in pyproject.toml checks this.

__main__                     the command `ground`
cli/watch                    the view in the terminal
cli/shell gateway ccsds page many verbs on one link; MAVLink ground programs; CCSDS ground systems; the browser's page
foxglove                     live data for Foxglove by WebSocket, read-only
cli/verbs                    the command line: requests to the rover and queries of the archive
cli/operations               one operation from start to exit code: a script in, news out
station products report      the link with keys, clock and saved state; products as files; a mission as one page
archive                      everything sent and received, in one SQLite file
link                         the link's end without I/O: requests, telemetry, contact, the rover's time
"""
