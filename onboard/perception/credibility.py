"""Consistency test of a measurement against its prediction."""

from __future__ import annotations

from onboard.native.linear import inner, solve
from onboard.records import F64

SURPRISE_LIMIT = 18.5  # chi-square, 4 degrees of freedom, 99.9 %


def credible(innovation: F64, covariance: F64) -> bool:
    """True if an innovation (4,) over x, y, z, yaw is within its covariance (4, 4): Mahalanobis distance, 99.9 %.

    Units m, rad. Raises numpy.linalg.LinAlgError for a singular covariance.
    """
    return inner(innovation, solve(covariance, innovation)) <= SURPRISE_LIMIT
