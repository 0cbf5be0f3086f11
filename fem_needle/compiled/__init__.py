"""The time loop compiled: one call for a whole row of steps, no Python per step (numba)."""
