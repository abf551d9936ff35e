"""`ground shell`: many verbs in one open session."""
