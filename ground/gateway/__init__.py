"""The gateway: MAVLink of local ground programs on one side, the rover's own link on the other.

    datagram --frames--> message --+-- desk (COMMAND_*) --orders--> requests --> Session --> the rover
    (signing where the port        +-- parameters (PARAM_*)            |
     asks for it)                  +-- missions (MISSION_*)        reports, items, events, products
                                   +-- vehicle <-----------------------+
                                         `--> HEARTBEAT, positions, STATUSTEXT, acknowledgements --> datagrams

`Gateway` is all of this without I/O: datagrams, news of the session and time in, datagrams out. Sockets: `shell`.
"""
