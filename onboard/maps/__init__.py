"""Maps as files: the orbiter's brought in (`onboard gdem`), the rover's own taken out (`onboard map`)."""
