"""Ports of the shell: clock, CAN bus, LIDAR bytes, link, disk, workers. The only folder with sockets and threads."""
