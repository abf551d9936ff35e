import numpy as np
from numpy.typing import NDArray

def wake_into(interval_ns: int, late_ns: NDArray[np.int64]) -> None: ...
