"""The command line of the station: verbs, operations, shell."""
