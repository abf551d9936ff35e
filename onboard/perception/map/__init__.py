"""Map: cells with statistics and classes, tiles that are stored, and the mapping work of a stop."""
