"""The command line: requests to the rover, queries of the archive, and the options that verbs share."""
