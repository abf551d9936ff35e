"""Whether what was measured can be true beside what was expected."""

from __future__ import annotations

from onboard.native.linear import inner, solve
from onboard.records import F64

SURPRISE_LIMIT = 18.5  # chi-square, 4 degrees of freedom, 99.9 %


def credible(innovation: F64, covariance: F64) -> bool:
    """Whether an innovation (4,) over x, y, z, yaw is within what its covariance (4, 4) allows (Mahalanobis, 99.9 %).

    m, rad. Raises numpy.linalg.LinAlgError for a singular covariance.
    """
    return inner(innovation, solve(covariance, innovation)) <= SURPRISE_LIMIT
