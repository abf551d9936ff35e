"""`ground shell`: many verbs on one open session."""
