"""Plant: the rover on its ground, with a physics engine and our own soil model."""
