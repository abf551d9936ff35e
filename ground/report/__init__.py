"""Report of a mission as one HTML file, from the files of its run."""
