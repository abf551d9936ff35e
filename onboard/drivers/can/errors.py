"""Meaning of CAN error frames and errno values: kinds for the counts, text for people. No bus is used.

An error frame's id is a set of classes (linux/can/error.h); of class CRTL, byte 1 tells more. python-can keeps the
classes of a socketcan frame and its data; its socketcand client drops the data, so the bench's hub sends byte 1 in bits
16 to 23 of the id too.
"""

from __future__ import annotations

import errno

from onboard.records import BusTrouble

BUS_OFF, CONTROLLER, RESTARTED = 0x40, 0x04, 0x100
_CLASSES = (  # the first bit that is set gives the kind
    (BUS_OFF, BusTrouble.BUS_OFF),
    (RESTARTED, BusTrouble.RESTARTED),
    (0x20, BusTrouble.NO_ACK),
    (0x8 | 0x80, BusTrouble.BUS_ERROR),
)
_DETAILS = (
    (0x30, BusTrouble.PASSIVE),
    (0x0C, BusTrouble.WARNING),
    (0x40, BusTrouble.ACTIVE),
    (0x03, BusTrouble.OVERFLOW),
)
GONE = (errno.ENODEV, errno.ENXIO, errno.EBADF)
FULL = (errno.ENOBUFS, errno.EAGAIN, errno.ENOMEM)


def kind_of(classes: int, detail: int) -> BusTrouble:
    """Kind of an error frame. classes: its id; detail: byte 1 of its data."""
    for bits, kind in _CLASSES:
        if classes & bits:
            return kind
    if classes & CONTROLLER:
        for bits, kind in _DETAILS:
            if detail & bits:
                return kind
    return BusTrouble.OTHER


def words_of(number: int | None, text: str) -> str:
    """Text for people about the errno of a read or a send; `text` if the number is not known here."""
    if number == errno.ENETDOWN:
        return "the interface is down (ip link set INTERFACE up)"
    if number in GONE:
        return "the interface is gone"
    if number in FULL:
        return "the transmit queue is full: nobody takes our frames"
    return text
