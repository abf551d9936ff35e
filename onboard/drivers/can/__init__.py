"""Drivers of the CAN bus, chosen by a URI: SocketCAN, socketcand, virtual; logs of a bus."""
