"""Classifier of one wheel's three blocks: ENCODER_BAD, WHEEL_STUCK, WHEEL_FREE, WHEEL_WEAK or none.

A sound drive has 8 N m where the ground needs 1 at most: it turns at the rate owed, to 0.001 rad/s. So

    position and told rate disagree: it hangs, or has jumped          the encoder
    it does not turn, and draws little                                the encoder, for the wheel must be turning
    it does not turn, and draws much, or nothing and is dragged       stuck
    its rate is not the one owed: the ground turns it                 free if it draws nothing, weak if it draws
                                                                      some, towards the rate owed, but too little
"""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.faults.wheels.blocks import BLOCKS, Block
from onboard.native.elementary import total

OWES_RADPS = 0.15  # wheels with slower orders are not judged
STILL_RATIO = 0.1  # of the rate owed: below it the wheel does not turn
STALL_A = 3.0  # the most that the ground needs is 1.4
NO_CURRENT_A = 0.03  # 3 sigma of a block's mean
WORK_A = 0.05  # mean of the other wheels: the ground needs drive
HARD_WORK_A = 0.35  # mean of the other wheels while they drag this one
OFF_RADPS = 0.01  # from the rate owed: half the slip of flat soil; a sound drive is within 0.001
LAG_S = 0.015  # added allowance: this times the ramp
DISAGREE_RADPS = 0.05  # position against told rate, mean of the blocks


def encoder_bad(blocks: Sequence[Block], others_a: float) -> bool:
    """Return whether the encoder's data is impossible, or shows no motion though the wheel must be turning.

    others_a: mean current of the other wheels, absolute values.
    """
    if len(blocks) < BLOCKS:
        return False
    if abs(total(b.turned_radps - b.told_radps for b in blocks)) > DISAGREE_RADPS * BLOCKS:
        return True
    most_a = max(STALL_A if b.current_a is None else abs(b.current_a) for b in blocks)
    dragged = most_a < NO_CURRENT_A and others_a > HARD_WORK_A
    return all(map(_still, blocks)) and most_a < STALL_A and not dragged


def drive_word(blocks: Sequence[Block], others_a: float) -> str | None:
    """Return the fault's name, or None; call after `encoder_bad`. others_a: mean absolute current of the others."""
    if len(blocks) < BLOCKS or any(b.current_a is None or abs(b.owed_radps) < OWES_RADPS for b in blocks):
        return None
    sign = 1.0 if blocks[-1].owed_radps > 0.0 else -1.0
    currents = [sign * (b.current_a or 0.0) for b in blocks]
    if any(map(_still, blocks)):  # the wheel or its encoder is stuck: a weak drive slows down gradually
        stuck = min(map(abs, currents[1:])) > STALL_A or max(map(abs, currents)) < NO_CURRENT_A
        return "WHEEL_STUCK" if stuck and all(map(_still, blocks)) else None
    offs = [sign * (b.turned_radps - b.owed_radps) for b in blocks]
    far = all(abs(off) > OFF_RADPS + LAG_S * b.ramp_radps2 for off, b in zip(offs, blocks))
    if not far or others_a < WORK_A or max(map(abs, currents)) > STALL_A:
        return None
    if max(map(abs, currents)) < NO_CURRENT_A:
        return "WHEEL_FREE"
    if min(map(abs, currents)) > NO_CURRENT_A and all((c > 0.0) == (off < 0.0) for c, off in zip(currents, offs)):
        return "WHEEL_WEAK"
    return None


def _still(block: Block) -> bool:
    owed = abs(block.owed_radps)
    return owed >= OWES_RADPS and abs(block.turned_radps) < STILL_RATIO * owed
