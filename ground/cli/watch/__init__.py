"""`ground watch` in a terminal: map, state, events, link, command line and a stop key. See `app`."""
