"""Every plot of the project, drawn from plain arrays."""
