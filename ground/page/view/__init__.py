"""View model of the page: a snapshot of the station as a tree for browsers."""
