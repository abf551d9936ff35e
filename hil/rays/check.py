"""What every caster asks of its rays."""

from __future__ import annotations

from onboard.records import F64


def check_rays(origins_m: F64, directions: F64) -> None:
    """Raises ValueError where origins and directions are not of one shape (n, 3)."""
    if origins_m.shape != directions.shape or origins_m.ndim != 2 or origins_m.shape[1] != 3:
        raise ValueError(f"origins_m, directions: expected (n, 3) both, given {origins_m.shape}, {directions.shape}")
