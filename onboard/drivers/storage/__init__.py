"""Drivers of the disk: state folder, record, map tiles."""
