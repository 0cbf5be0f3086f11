"""What the numbers of a uniform run's row mean; SI."""

from __future__ import annotations

# START: the tip deflection [m] of the static shape under a tip force that is let go at t = 0 (0: straight), or NaN: equilibrium.
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
    START,
) = range(15)
VALUES = 15
