"""Live side of the page: the link's thread, short histories, orders."""
