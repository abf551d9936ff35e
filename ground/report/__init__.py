"""A mission as one HTML file, from the files that its run left."""
