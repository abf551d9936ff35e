"""The hardware-in-the-loop bench: it replaces hardware, nothing else."""
