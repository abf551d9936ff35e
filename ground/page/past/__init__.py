"""Past runs of the page: the archive, the time slider."""
