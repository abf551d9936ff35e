"""Hardware-in-the-loop bench: emulates the hardware around the unchanged flight program."""
