"""The world of a run: rover on its ground, nodes, scanner, true state, disk and computer, operator."""
