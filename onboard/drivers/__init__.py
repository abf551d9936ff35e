"""The shell's ports: clock, CAN bus, LIDAR bytes, link, disk, workers. The only place with sockets and threads."""
