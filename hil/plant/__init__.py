"""The rover on its ground, by the physics engine and a soil model of our own."""
