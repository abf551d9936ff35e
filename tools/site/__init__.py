"""The documentation as a site: pages, diagrams, build, check."""
