"""The command line of the station: verbs, operations, shell, view in the terminal."""
