"""Movements by hand: `onboard can jog`, `home`, `reset`; who may move what, how far, and how it ends."""
