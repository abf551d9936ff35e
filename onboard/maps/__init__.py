"""Map files: import of the orbiter's map (`onboard gdem`), export of the rover's own (`onboard map`)."""
