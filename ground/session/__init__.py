"""One station's end of the link without I/O: what was asked, what is known of the rover and of its time."""
