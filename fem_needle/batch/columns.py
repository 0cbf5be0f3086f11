"""What the numbers of a uniform run's row mean; SI."""

from __future__ import annotations

# Columns of a run's values.
(
    STIFFNESS,
    MASS,
    MODULUS,
    VISCOSITY,
    DEPTH,
    SPEED,
    ARRIVAL,
    FORCE,
    AMPLITUDE,
    FREQUENCY,
    PHASE,
    DURATION,
    OUTPUT_STEP,
    TIME_STEP,
) = range(14)
VALUES = 14
