"""What the tests about the trigger share."""

NOISE = {"noise_m_sqrt_s": 0.004, "leak_1_s": 0.0, "noise_period_s": 0.05, "duration_s": 30.0}
REFINE = {"zeta_m": 3.0, "released_below_m": 2.0, "dwell_s": 0.5, **NOISE}
