"""A run in a browser: scene, control panel, playback time, and the loop that serves them."""
