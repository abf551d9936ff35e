"""Explanations in the report: rows of the mission rule, events that look worse than they are, wheel numbers."""

from __future__ import annotations

RULES = {  # `onboard/planning/mission_rule.py`
    "R1": ("start", "two scans at the first stop, ahead and behind; one at every other."),
    "R2": ("trail", "poses the rover has driven over stay free."),
    "R4": (
        "terminal",
        "a pose within the tolerance of the goal is reachable over free poses, so the rover drives to "
        "the one nearest to the goal, or stays.",
    ),
    "R5": (
        "commit",
        "the rover follows the optimistic path, for which unknown ground is free, to its last free pose "
        "and looks at the first that is not.",
    ),
    "R6": (
        "failed try",
        "a scan that showed nothing of its target is not repeated; the rover looks from elsewhere, "
        "and after two such tries the target counts as an obstacle.",
    ),
    "R7": (
        "confirm",
        "no way is left, so what is blocked farther than 3 m from every stop is taken as unknown and "
        "looked at once more.",
    ),
    "R8": ("again", "still no way, so targets marked as obstacles are unmarked, once in a mission."),
    "R9": ("give up", "no way is left over free or unknown ground; the nearest reachable pose is told."),
    "R10": ("choice", "the strategy's own stop, as long as the way left keeps shrinking."),
    "R11": (
        "look again",
        "the rule would give up on a side of which the scanner saw too little, so the rover turns to "
        "it and sweeps it again, slowly and twice.",
    ),
}
ALWAYS = ("R1", "R2")  # they decide nothing that a record shows, and apply at each stop
EXPECTED_REFUSAL = (
    "A refused registration at the first stop is expected: the second scan looks the other way and shares no ground "
    "with the first. A scan that is refused is mapped where the rover's own estimate places it."
)
TICKS = (
    "Wall time of the ticks: how long the bench took for plant and devices, and how long until onboard had answered as "
    "well; both run at once. It depends on the machine, and no decision depends on it."
)
WHEELS = "wheel 1 front left, 2 rear left, 3 rear right, 4 front right"
TIME_LINE = (
    "Battery, currents, link and events over the seconds of the run; the bands are the mission's phases. Currents of "
    "the wheels are those of their drive motors. The link's rates are means over 5 s, of what the rover sent, whether "
    "it arrived or not, and of what reached the rover."
)
SIGMA = (
    "The blue band is twice the rover's own 1 sigma: an error outside of it is larger than the rover would have told."
)
RIM = "Pale yellow is no obstacle: no pose is free there only because a wheel would stand on ground that was not seen."
CONTACTS = (
    "Counted is each contact of a wheel with a rock of 0.08 m or more, and each of the body with anything, by the "
    "bench; the rover is not told."
)
