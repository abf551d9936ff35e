"""The command line: what is asked of the rover, and of the archive; the options that verbs share."""
