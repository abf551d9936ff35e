"""Missions: the phases of a goto, survey and tour, return to the start, drive guard."""
