"""One station's end of the link without I/O: requests, the known state of the rover, and its clock."""
