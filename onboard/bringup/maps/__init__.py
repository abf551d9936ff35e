"""Commands for maps: import of terrain models, export of maps and scans."""
