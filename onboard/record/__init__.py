"""Record of every input and output of the core, and its replay."""
