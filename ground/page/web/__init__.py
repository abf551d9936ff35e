"""Web side of the page: access, guard, routes, STOP."""
