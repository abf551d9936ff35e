"""Next sensing position: visibility, gain of a place, search for the best place, strategies by name."""
