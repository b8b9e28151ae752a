import numpy as np
from numpy.typing import NDArray

from airground_drake.model.law.tasks import PositionTask


class Lead(PositionTask):
    """Fly over the first UGV."""

    def __init__(
        self, ugv_positions: NDArray[np.float64], ugv_velocities: NDArray[np.float64], altitude: float, gain: float
    ) -> None:
        """Positions (n, 3), m, and velocities (n, 3), m/s, of the UGVs; altitude, m; gain, 1/s."""
        super().__init__(ugv_positions[:1] + [0.0, 0.0, altitude], ugv_velocities[:1], gain)
