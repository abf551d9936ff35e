"""The ground station. Each folder imports those below it only; the import contract in pyproject.toml holds it so.

    __main__                     the command `ground`
    shell   gateway   bridge     many verbs on one link; MAVLink ground programs; CCSDS ground systems
    verbs                        the command line, and what it asks of rover and archive
    operation                    one operation from start to exit code: a script in, news out
    station products report      the link with keys, clock and memory; products as files; a mission as one page
    archive                      everything sent and heard, in one SQLite file
    session                      the link's end without I/O: requests, telemetry, contact, the rover's time
"""
