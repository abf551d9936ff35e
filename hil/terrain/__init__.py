"""Ground of the runs: synthesis, files and names."""
