"""The Kalman filter's two equations for a covariance, on plain arrays; the state is the caller's.

filterpy has the same two, and is their oracle in the tests. It is not used on board: its filter cannot be imported
without all of scipy.stats, which was more than half of the program's start.
"""

from __future__ import annotations

import numpy as np

from onboard.records import F64


def predicted(P: F64, F: F64, Q: F64) -> F64:
    """The covariance (n, n) after a step with transition F (n, n) and noise Q (n, n)."""
    moved: F64 = F @ P @ F.T + Q
    return moved


def corrected(P: F64, H: F64, R: F64) -> tuple[F64, F64]:
    """(gain K (n, m), covariance after it) of a measurement by H (m, n) with noise R (m, m); Joseph's form.

    The state moves by K @ (measured - expected). Raises LinAlgError where H P H' + R is singular.
    """
    PHT = P @ H.T
    K = np.asarray(np.linalg.solve((H @ PHT + R).T, PHT.T).T, np.float64)
    left = np.eye(len(P)) - K @ H
    return K, left @ P @ left.T + K @ R @ K.T
