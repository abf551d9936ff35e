"""Argument check common to all ray casters."""

from __future__ import annotations

from onboard.records import F64


def check_rays(origins_m: F64, directions: F64) -> None:
    """Raise ValueError unless origins and directions have the same shape (n, 3)."""
    if origins_m.shape != directions.shape or origins_m.ndim != 2 or origins_m.shape[1] != 3:
        raise ValueError(f"origins_m, directions: expected (n, 3) both, given {origins_m.shape}, {directions.shape}")
